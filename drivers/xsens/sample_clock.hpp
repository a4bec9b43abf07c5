#pragma once
#include <cstdint>
#include <optional>

#include "drivers/device.hpp"

namespace vergence::xsens {

/// What a new stamp is against the last one.
enum class ClockStep : std::uint8_t {
  first,
  forward,
  backward,  // not after the last one: not a new sample
  restart,   // the clock was set, or the device restarted
};

/// Unwraps SampleTimeFine: 0.1 ms, wrapping at one day on MTi 10/100 series and the 700/710, at 2³²
/// on others.
///
/// Threads  One caller. Time: the device's, from the first stamp on; goes on over a restart by what
///          `elapsed` says has passed.
class SampleTime {
 public:
  /// `elapsed`: of the host's clock since the last stamp, roughly.
  [[nodiscard]] ClockStep next(std::uint32_t ticks, Duration elapsed) noexcept;
  [[nodiscard]] DeviceStamp stamp() const noexcept { return DeviceStamp(ticks_ * kTick); }
  /// The unwrapped time of a stamp near the last one, older or newer, without taking it.
  [[nodiscard]] std::optional<DeviceStamp> near(std::uint32_t ticks) const noexcept;

 private:
  static constexpr std::int64_t kTick = 100'000;        // ns
  static constexpr std::int64_t kDay = 864'000'000;     // ticks
  static constexpr std::int64_t kFull = 4'294'967'296;  // ticks
  static constexpr std::int64_t kFarthest =
      100'000;  // ticks, 10 s: a gap, beyond it a clock that was set
  [[nodiscard]] std::int64_t difference(std::uint32_t ticks) const noexcept;

  bool known_ = false;
  std::uint32_t last_ = 0;  // as sent
  std::int64_t ticks_ = 0;  // unwrapped
};

/// Unwraps the MTi-G's sample counter, 16 bits.
class SampleCounter {
 public:
  [[nodiscard]] ClockStep next(std::uint16_t counter, std::int64_t expected_steps) noexcept;
  [[nodiscard]] std::int64_t count() const noexcept { return count_; }

 private:
  bool known_ = false;
  std::uint16_t last_ = 0;
  std::int64_t count_ = 0;
};

}  // namespace vergence::xsens
