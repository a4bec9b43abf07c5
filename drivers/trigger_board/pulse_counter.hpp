#pragma once
#include <cstdint>

#include "drivers/trigger.hpp"
#include "firmware_iface/trigger/trigger.h"

namespace vergence::trigger_board {

/// Counters since open.
struct PulseCounters {
  /// Number of accepted events.
  std::uint64_t pulses = 0;
  /// Numbers without an event, except those of a pause or reported as skipped.
  std::uint64_t lost = 0;
  /// Events that cannot follow the one before.
  std::uint64_t refused = 0;
  std::uint64_t exposures_refused = 0;
};

/// Turns events into pulses: unwraps their numbers, counts gaps by cause, refuses invalid events.
///
/// An event is refused if its number is not after the last one, its tick is earlier, or more pulses
/// are missing than the rate permits. `edge` is the trigger board's ticks in nanoseconds. Not
/// thread-safe. Does not allocate.
class PulseCounter {
 public:
  /// Handles a start of the trigger board; `next` is the number of its next pulse.
  void begin(std::uint32_t boot, std::uint32_t next) noexcept;
  /// Sets the configured intervals, which limit the number of pulses between two ticks.
  void set_intervals(std::uint32_t rate_millihertz, std::uint32_t dither_us) noexcept;
  /// Expects a pause that omits this number of pulses.
  void expect_pause(std::uint32_t pulses) noexcept { asked_ += pulses; }
  /// Cancels the expected pause.
  void clear_pause() noexcept { asked_ = 0; }
  /// Allows the next event to be earlier than the last, because the clock was set back.
  void clear_time() noexcept { any_ = false, tick_ = 0; }
  /// Handles the end of the pulses: those missing before number `next` were lost, except for
  /// `to_come` outstanding reports.
  void end(std::uint32_t next, std::uint32_t to_come) noexcept;
  /// Sets all of *pulse but the arrival and the host's time. Returns false if the event is refused;
  /// *pulse is then unchanged.
  [[nodiscard]] bool accept(const TriggerEvent& event, Pulse* pulse) noexcept;

  [[nodiscard]] std::uint32_t boot() const noexcept { return boot_; }
  [[nodiscard]] const PulseCounters& counters() const noexcept { return counters_; }
  /// Number of refused events since the last accepted one.
  [[nodiscard]] int refused_in_row() const noexcept { return in_row_; }

 private:
  [[nodiscard]] bool refuse() noexcept;

  std::uint32_t boot_ = 0;
  // Expected number.
  std::uint64_t next_ = 0;
  // True once an event was accepted since begin().
  bool any_ = false;
  // Tick of the last event.
  std::uint64_t tick_ = 0;
  std::uint64_t shortest_us_ = 1;
  // Pulses that a pause will omit.
  std::uint64_t asked_ = 0;
  int in_row_ = 0;
  PulseCounters counters_{};
};

/// Limit of valid ticks: about thirty years.
inline constexpr std::uint64_t kMaxTicks = 1'000'000'000'000'000;

[[nodiscard]] inline DeviceStamp stamp_of_tick(std::uint64_t tick) noexcept {
  return DeviceStamp(static_cast<std::int64_t>(tick) * 1000);
}

}  // namespace vergence::trigger_board
