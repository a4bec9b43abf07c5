#include "drivers/xsens/sample_clock.hpp"

#include <algorithm>
#include <cstdlib>

namespace vergence::xsens {

std::int64_t SampleTime::difference(std::uint32_t ticks) const noexcept {
  const std::int64_t plain = static_cast<std::int64_t>(ticks) - static_cast<std::int64_t>(last_);
  // The nearest of the three: no wrap, a day's, the full width's. A counter that has been past a
  // day's end has the full width.
  std::int64_t best = plain;
  for (const std::int64_t modulus : {kDay, kFull}) {
    if (modulus == kDay && (last_ >= kDay || ticks >= kDay)) continue;
    for (const std::int64_t d : {plain + modulus, plain - modulus})
      if (std::llabs(d) < std::llabs(best)) best = d;
  }
  return best;
}

ClockStep SampleTime::next(std::uint32_t ticks, Duration elapsed) noexcept {
  if (!known_) {
    known_ = true;
    last_ = ticks;
    ticks_ = ticks;
    return ClockStep::first;
  }
  const std::int64_t d = difference(ticks);
  if (d > kFarthest || d < -kFarthest) {
    // Something that only grows goes on for those who look at differences.
    ticks_ += std::max<std::int64_t>(1, elapsed.ns() / kTick);
    last_ = ticks;
    return ClockStep::restart;
  }
  if (d <= 0) return ClockStep::backward;
  ticks_ += d;
  last_ = ticks;
  return ClockStep::forward;
}

std::optional<DeviceStamp> SampleTime::near(std::uint32_t ticks) const noexcept {
  if (!known_) return std::nullopt;
  const std::int64_t d = difference(ticks);
  if (d > kFarthest || d < -kFarthest) return std::nullopt;
  return DeviceStamp((ticks_ + d) * kTick);
}

ClockStep SampleCounter::next(std::uint16_t counter, std::int64_t expected_steps) noexcept {
  if (!known_) {
    known_ = true;
    last_ = counter;
    count_ = counter;
    return ClockStep::first;
  }
  const auto d = static_cast<std::uint16_t>(counter - last_);
  last_ = counter;
  // The step that is nearest to what the time between says, of those that the sixteen bits allow.
  constexpr std::int64_t kWrap = 65536, kTolerance = 2048;
  const std::int64_t wraps = (expected_steps - d + kWrap / 2) / kWrap;
  const std::int64_t steps = d + std::max<std::int64_t>(0, wraps) * kWrap;
  if (steps == 0) return ClockStep::backward;
  if (std::llabs(steps - expected_steps) > kTolerance) {
    count_ += std::max<std::int64_t>(1, expected_steps);
    return ClockStep::restart;
  }
  count_ += steps;
  return ClockStep::forward;
}

}  // namespace vergence::xsens
