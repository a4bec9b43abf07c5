#pragma once
#include <cstdint>

/// Bus clock of IEEE 1394 and camera stamps derived from it: seconds, cycles of 125 µs, 3072 ticks
/// per cycle.
namespace vergence::iidc {

inline constexpr std::int64_t kCycleNs = 125'000;
inline constexpr std::int64_t kTicksPerCycle = 3072;
/// The counter has seven bits of seconds.
inline constexpr std::int64_t kCycleTimeWrapNs = 128'000'000'000;

struct CycleTime {
  /// 0 to 127.
  std::uint32_t seconds = 0;
  /// 0 to 7999.
  std::uint32_t cycle = 0;
  /// 0 to 3071.
  std::uint32_t tick = 0;

  [[nodiscard]] static constexpr CycleTime of(std::uint32_t q) noexcept {
    return {q >> 25U, q >> 12U & 0x1FFFU, q & 0xFFFU};
  }
  [[nodiscard]] constexpr bool valid() const noexcept {
    return seconds < 128 && cycle < 8000 && tick < kTicksPerCycle;
  }
  [[nodiscard]] constexpr std::uint32_t quadlet() const noexcept {
    return seconds << 25U | cycle << 12U | tick;
  }
  /// Time since the last wrap, rounded to the nearest nanosecond.
  [[nodiscard]] constexpr std::int64_t ns() const noexcept {
    return seconds * std::int64_t{1'000'000'000} + cycle * kCycleNs +
           (tick * kCycleNs + kTicksPerCycle / 2) / kTicksPerCycle;
  }
  /// Converts a time ≥ 0; the tick is rounded down.
  [[nodiscard]] static constexpr CycleTime at(std::int64_t ns) noexcept {
    const std::int64_t within = ns % 1'000'000'000;
    return {static_cast<std::uint32_t>(ns / 1'000'000'000 % 128),
            static_cast<std::uint32_t>(within / kCycleNs),
            static_cast<std::uint32_t>(within % kCycleNs * kTicksPerCycle / kCycleNs)};
  }
};

/// Unwraps stamps that wrap after 128 s.
///
/// Wraps are counted by the host's clock instead of by stamps, so pauses of hours have no effect.
/// Cameras on one 1394 bus share a clock and an unwrapper; their stamps are then comparable
/// regardless of the order of starting. The drift between two calls must stay below 64 s: more than
/// a week at 100 ppm. One caller at a time.
class CycleUnwrapper {
 public:
  /// `wrapped_ns` as CycleTime::ns(); `host_ns` is on any steady clock, at about the same time
  /// (within 30 s).
  [[nodiscard]] std::int64_t unwrap(std::int64_t wrapped_ns, std::int64_t host_ns) noexcept;
  /// Forgets the state, because the clock was restarted.
  void restart() noexcept { known_ = false; }

 private:
  bool known_ = false;
  // Last unwrapped time.
  std::int64_t last_ns_ = 0;
  std::int64_t last_host_ns_ = 0;
};

}  // namespace vergence::iidc
