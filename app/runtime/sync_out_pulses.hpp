#pragma once
#include <cstdint>
#include <optional>

#include "drivers/ins.hpp"
#include "drivers/sync/clock_mapper.hpp"
#include "drivers/trigger.hpp"

namespace vergence::app {

/// The INS's SyncOut as a source of pulses, from the readings it streams.
///
/// Numbers   From the INS's own clock, which makes the pulses too: intervals of it since the first pulse. So a reading that was lost loses
///           no number. Every start of the INS is another boot.
/// Marked    A device that marks its pulses in the stream (MTi-G-700/710) says which reading a pulse left with: the pulse is at the
///           multiple of the interval that is nearest to it, reckoned from the earliest mark. One that does not (legacy MTi-G) pulses with
///           every n-th sample from its first.
/// Threads   One caller. Memory: fixed.
class SyncOutPulses {
 public:
  /// `interval`: between two pulses as the INS makes them. `marked`: it marks them.
  SyncOutPulses(Duration interval, bool marked) noexcept : interval_(interval), marked_(marked) {}

  /// The pulse that this reading tells of, if it does.
  [[nodiscard]] std::optional<Pulse> take(const InsReading& reading, const MappedStamp& measured) noexcept;
  /// The INS was started anew: its pulses begin again.
  void restart() noexcept {
    any_ = false;
    ++boot_;
  }
  [[nodiscard]] std::uint64_t pulses() const noexcept { return pulses_; }

 private:
  Duration interval_;
  bool marked_;
  bool any_ = false;
  DeviceStamp first_{};
  std::uint64_t newest_ = 0, pulses_ = 0;
  std::uint32_t boot_ = 1;
};

}  // namespace vergence::app
