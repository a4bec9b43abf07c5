#pragma once
#include <cstdint>

#include "core/types/time.hpp"

namespace vergence::trigger_board {

/// Which edge of an input counts.
enum class Edge : std::uint8_t { none, rising, falling };

/// Connection of a trigger board and use of its additional inputs.
struct Options {
  std::uint32_t baud = 0;  // 0: found by asking at kBauds
  bool native_usb =
      false;  // bytes never are on a wire at the baud rate: the board's own USB, a pseudo-terminal
  Edge pps = Edge::none;  // GNSS pulse per second, which disciplines the board's ticks
  Edge ins = Edge::none;  // the INS' SyncOut
  /// Between two questions for the board's time; each is up to a fifth sooner or later, so that no
  /// period of the line hides its floor.
  Duration ping_interval = Duration::milliseconds(10);
};

}  // namespace vergence::trigger_board
