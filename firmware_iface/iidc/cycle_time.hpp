#pragma once
#include <cstdint>

/// The bus clock of IEEE 1394, and the stamps cameras take from it: seconds, cycles of 125 µs, 3072
/// ticks to a cycle.
namespace vergence::iidc {

inline constexpr std::int64_t kCycleNs = 125'000;
inline constexpr std::int64_t kTicksPerCycle = 3072;
inline constexpr std::int64_t kCycleTimeWrapNs = 128'000'000'000;  // seven bits of seconds

struct CycleTime {
  std::uint32_t seconds = 0;  // 0 … 127
  std::uint32_t cycle = 0;    // 0 … 7999
  std::uint32_t tick = 0;     // 0 … 3071

  [[nodiscard]] static constexpr CycleTime of(std::uint32_t q) noexcept {
    return {q >> 25U, q >> 12U & 0x1FFFU, q & 0xFFFU};
  }
  [[nodiscard]] constexpr bool valid() const noexcept {
    return seconds < 128 && cycle < 8000 && tick < kTicksPerCycle;
  }
  [[nodiscard]] constexpr std::uint32_t quadlet() const noexcept {
    return seconds << 25U | cycle << 12U | tick;
  }
  /// Since the last wrap, rounded to the nearest nanosecond.
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

/// Stamps that wrap after 128 s, into ones that do not.
///
/// The wraps are counted by the host's clock, never by counting stamps: a pause of hours changes
/// nothing. Cameras on one 1394 bus share a clock and therefore share an unwrapper; then their
/// stamps are comparable whichever was started first.
/// Threads  One caller at a time. Memory: in place.
/// Limits   The clock's drift against the host's may add up to 64 s between two calls: more than a
///          week at 100 ppm.
class CycleUnwrapper {
 public:
  /// `wrapped_ns` as CycleTime::ns(); `host_ns` of any steady clock, of about the same moment
  /// (within 30 s).
  [[nodiscard]] std::int64_t unwrap(std::int64_t wrapped_ns, std::int64_t host_ns) noexcept;
  /// Forgets: the clock was restarted.
  void restart() noexcept { known_ = false; }

 private:
  bool known_ = false;
  std::int64_t last_ns_ = 0;  // unwrapped
  std::int64_t last_host_ns_ = 0;
};

}  // namespace vergence::iidc
