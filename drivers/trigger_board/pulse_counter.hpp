#pragma once
#include <cstdint>

#include "drivers/trigger.hpp"
#include "firmware_iface/trigger/trigger.h"

namespace vergence::trigger_board {

/// Counters since open.
struct PulseCounters {
  std::uint64_t pulses = 0;   // taken
  std::uint64_t lost = 0;     // numbers that no event came for, without a pause, and that the board
                              // does not say it skipped
  std::uint64_t refused = 0;  // events that cannot follow the one before
  std::uint64_t exposures_refused = 0;
};

/// Events to pulses: numbers unwrapped, what is missing sorted by cause, invalid events refused.
///
/// Not thread-safe. Does not allocate. Time: `edge` is the board's ticks in nanoseconds.
/// Errors   An event that cannot follow the one before is refused and counted: its number is not
///          after the last one, its tick is earlier, or more pulses lie between than the rate
///          makes.
class PulseCounter {
 public:
  /// A start of the board, `next` being the number of its next pulse.
  void begin(std::uint32_t boot, std::uint32_t next) noexcept;
  /// Pulses as they were asked for: how many fit between two ticks.
  void set_intervals(std::uint32_t rate_millihertz, std::uint32_t dither_us) noexcept;
  /// So many pulses shall be left out.
  void expect_pause(std::uint32_t pulses) noexcept { asked_ += pulses; }
  /// They will not be after all.
  void clear_pause() noexcept { asked_ = 0; }
  /// The board's clock was set back: the next event may be earlier than the last.
  void clear_time() noexcept { any_ = false, tick_ = 0; }
  /// Pulses are over, the board says, and the next would have this number: what is missing was
  /// lost, but for so many whose reports are still to come.
  void end(std::uint32_t next, std::uint32_t to_come) noexcept;
  /// False: refused, *pulse is as it was. Sets all of it but the arrival and the host's time.
  [[nodiscard]] bool take(const TriggerEvent& event, Pulse* pulse) noexcept;

  [[nodiscard]] std::uint32_t boot() const noexcept { return boot_; }
  [[nodiscard]] const PulseCounters& counters() const noexcept { return counters_; }
  /// Refused since the last that was taken.
  [[nodiscard]] int refused_in_row() const noexcept { return in_row_; }

 private:
  [[nodiscard]] bool refuse() noexcept;

  std::uint32_t boot_ = 0;
  std::uint64_t next_ = 0;  // number expected
  bool any_ = false;        // an event has been taken since begin()
  std::uint64_t tick_ = 0;  // of the last
  std::uint64_t shortest_us_ = 1;
  std::uint64_t asked_ = 0;  // pulses that a pause will leave out
  int in_row_ = 0;
  PulseCounters counters_{};
};

/// Beyond this a tick is invalid: thirty years.
inline constexpr std::uint64_t kMaxTicks = 1'000'000'000'000'000;

[[nodiscard]] inline DeviceStamp stamp_of_tick(std::uint64_t tick) noexcept {
  return DeviceStamp(static_cast<std::int64_t>(tick) * 1000);
}

}  // namespace vergence::trigger_board
