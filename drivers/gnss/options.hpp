#pragma once
#include <cstdint>

#include "core/types/time.hpp"

namespace vergence::gnss {

enum class Protocol : std::uint8_t { nmea, ubx };

struct Options {
  Protocol protocol = Protocol::nmea;
  std::uint32_t baud = 0;  // 0: found by listening
  // From the instant of the fix to the first byte on the line.
  Duration processing = Duration::milliseconds(2);
};

}  // namespace vergence::gnss
