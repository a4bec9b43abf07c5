#pragma once
#include <cstdint>

#include "core/types/time.hpp"

namespace vergence::trigger_board {

/// Edge of an input that is used.
enum class Edge : std::uint8_t { none, rising, falling };

/// Connection of a trigger board and use of its additional inputs.
struct Options {
  /// 0 probes the rates in kBauds.
  std::uint32_t baud = 0;
  /// True if bytes have no wire time at the baud rate: the trigger board's own USB, or a
  /// pseudo-terminal.
  bool native_usb = false;
  /// Edge of the GNSS pulse per second, which disciplines the ticks.
  Edge pps = Edge::none;
  /// Edge of the INS's SyncOut.
  Edge ins = Edge::none;
  /// Interval of the pings; each is dithered by up to a fifth, so that no periodic load on the link
  /// hides its minimum delay.
  Duration ping_interval = Duration::milliseconds(10);
};

}  // namespace vergence::trigger_board
