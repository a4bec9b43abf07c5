#pragma once
#include <cstdint>

#include "core/types/time.hpp"

namespace vergence::gnss {

enum class Protocol : std::uint8_t { nmea, ubx };

struct Options {
  Protocol protocol = Protocol::nmea;
  /// 0 finds the rate by listening.
  std::uint32_t baud = 0;
  // Delay from the instant of the fix to its first byte on the link.
  Duration processing = Duration::milliseconds(2);
};

}  // namespace vergence::gnss
