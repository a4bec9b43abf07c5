#pragma once
#include <cstdint>

/// Named choices of the simulated world.
namespace vergence::mock {

enum class DriveKind : std::uint8_t {
  loop,          // 1 km round the town: right turns, two stops, hills, ends 6 m past its start
  figure_eight,  // 1 km, left and right turns
  straight,      // 480 m along a hilly street with one stop
  brief,         // 120 m with one corner
  still,         // stands for 30 s
};

enum class Pattern : std::uint8_t {
  grey,  // a monochrome sensor
  gbrg,  // Bayer: green blue / red green
};

}  // namespace vergence::mock
