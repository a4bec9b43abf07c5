#pragma once
#include <cstdint>

/// Options of the simulated world.
namespace vergence::mock {

enum class DriveKind : std::uint8_t {
  /// 1 km round the town with right turns, two stops and hills; ends 6 m past its start.
  loop,
  /// 1 km with left and right turns.
  figure_eight,
  /// 480 m along a hilly street with one stop.
  straight,
  /// 120 m with one corner.
  brief,
  /// Stands for 30 s.
  still,
};

enum class Pattern : std::uint8_t {
  /// Monochrome sensor.
  grey,
  /// Bayer pattern: green blue / red green.
  gbrg,
};

}  // namespace vergence::mock
