#include "drivers/sync/clock_tie.hpp"

#include <algorithm>

#include "drivers/sync/durations.hpp"

namespace vergence {

void ClockTie::clear() noexcept {
  pairs_ = 0;
  rate_ = 0;
}

DeviceStamp ClockTie::to_edge(DeviceStamp stamp) const noexcept {
  const Duration since = stamp - stamp_;
  return edge_ + since + scaled(since, rate_);
}

Duration ClockTie::gate(DeviceStamp stamp) const noexcept {
  constexpr Duration kMin = Duration::microseconds(50);
  // Change of the rate over a gap without pairs.
  constexpr double kWander = 30e-6;
  const Duration near = std::min(noise_ * 4 + kMin, interval_ / 5);
  const Duration since = stamp - stamp_;
  return near + scaled(magnitude(since), kWander);
}

void ClockTie::add(DeviceStamp stamp, DeviceStamp edge) noexcept {
  if (pairs_ == 0) {
    stamp_ = stamp;
    edge_ = edge;
    pairs_ = 1;
    return;
  }
  const Duration since = stamp - stamp_;
  if (since <= Duration{}) return;
  pairs_ = std::min(pairs_ + 1, kMemory);
  const double n = pairs_, g = 2 * (2 * n - 1) / (n * (n + 1)), h = 6 / (n * (n + 1));
  const DeviceStamp expected = to_edge(stamp);
  const Duration off = edge - expected;
  stamp_ = stamp;
  edge_ = expected + scaled(off, g);
  rate_ = std::clamp(rate_ + h * static_cast<double>(off.ns()) / static_cast<double>(since.ns()),
                     -kMaxDrift, kMaxDrift);
}

}  // namespace vergence
