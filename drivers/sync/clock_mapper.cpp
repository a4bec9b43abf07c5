#include "drivers/sync/clock_mapper.hpp"

#include <algorithm>
#include <cmath>

namespace vergence {
namespace {

Duration rounded(double ns) noexcept { return Duration::nanoseconds(std::llround(ns)); }

}  // namespace

void ClockMapper::begin(DeviceStamp device, HostStamp arrival) noexcept {
  restart();
  origin_ = device;
  host_origin_ = arrival - options_.least_delay;
  points_[0] = {0, 0};
  count_ = 1;
  newest_bin_ = 0;
  worst_ = 0;
}

MappedStamp ClockMapper::map(DeviceStamp device, HostStamp arrival) noexcept {
  if (count_ == 0) {
    begin(device, arrival);
    return {host_origin_, options_.delay_spread + options_.resolution};
  }
  const double at = static_cast<double>((device - origin_).ns());
  const double delay = static_cast<double>((arrival - options_.least_delay - host_origin_).ns()) - at;
  const double above = delay - (intercept_ + slope_ * at);
  // What the drift may have done since the newest pair is no jump.
  const double silent = std::max(0.0, at - points_[count_ - 1].device);
  if (above < -(static_cast<double>(options_.jump.ns()) + 2 * options_.drift_bound * silent)) {
    ++resets_;
    begin(device, arrival);
    return {host_origin_, options_.delay_spread + options_.resolution};
  }
  if (above > static_cast<double>(options_.stall.ns()) || at < points_[count_ - 1].device - 2 * static_cast<double>(kBin.ns())) {
    // A stall or a clock set back: which, the next ones tell. Until then the arrival is the better witness, within the stall.
    if (++behind_ >= kBehind) {
      ++resets_;
      begin(device, arrival);
      return {host_origin_, options_.delay_spread + options_.resolution};
    }
    return {arrival - options_.least_delay, options_.delay_spread + options_.stall};
  }
  behind_ = 0;
  lagging_ = above > static_cast<double>(options_.jump.ns()) ? lagging_ + 1 : 0;
  if (lagging_ >= kLagging) {
    ++resets_;
    begin(device, arrival);
    return {host_origin_, options_.delay_spread + options_.resolution};
  }
  take({at, delay});
  fit();
  return {host_origin_ + rounded(at * (1 + slope_) + intercept_), error_at(at)};
}

void ClockMapper::ping(HostStamp t1, DeviceStamp t2, DeviceStamp t3, HostStamp t4) noexcept {
  if (t4 < t1 || t3 < t2) return;
  (void)map(t3, t4 + options_.least_delay);
}

MappedStamp ClockMapper::at(DeviceStamp device) const noexcept {
  const double at = static_cast<double>((device - origin_).ns());
  return {host_origin_ + rounded(at * (1 + slope_) + intercept_), error_at(at)};
}

void ClockMapper::take(const Point& p) noexcept {
  const auto bin = static_cast<std::int64_t>(std::floor(p.device / static_cast<double>(kBin.ns())));
  if (bin <= newest_bin_) {
    // Compared along the line, so that drift inside the bin does not decide.
    Point& held = points_[count_ - 1];
    if (p.delay - slope_ * p.device < held.delay - slope_ * held.device) held = p;
    return;
  }
  newest_bin_ = bin;
  if (count_ == kBins) {
    std::move(points_.begin() + 1, points_.end(), points_.begin());
    --count_;
  }
  points_[count_++] = p;
}

void ClockMapper::fit() noexcept {
  double mean = 0;
  for (std::size_t i = 0; i < count_; ++i) mean += points_[i].device / static_cast<double>(count_);
  // Lower convex hull, left to right (Andrew's monotone chain): the points ascend in device time.
  std::array<std::size_t, kBins> hull{};
  std::size_t n = 0;
  const auto below = [&](const Point& a, const Point& b, const Point& c) {
    return (b.device - a.device) * (c.delay - a.delay) - (b.delay - a.delay) * (c.device - a.device) <= 0;
  };
  for (std::size_t i = 0; i < count_; ++i) {
    while (n >= 2 && below(points_[hull[n - 2]], points_[hull[n - 1]], points_[i])) --n;
    hull[n++] = i;
  }
  slope_ = 0;
  for (std::size_t i = 0; i + 1 < n; ++i) {
    const Point &a = points_[hull[i]], &b = points_[hull[i + 1]];
    if (b.device > a.device) slope_ = (b.delay - a.delay) / (b.device - a.device);
    if (b.device >= mean) break;
  }
  slope_ = std::clamp(slope_, -options_.drift_bound, options_.drift_bound);
  intercept_ = points_[0].delay - slope_ * points_[0].device;
  for (std::size_t i = 1; i < count_; ++i) intercept_ = std::min(intercept_, points_[i].delay - slope_ * points_[i].device);
  worst_ = 0;
  for (std::size_t i = 0; i < count_; ++i) worst_ = std::max(worst_, points_[i].delay - slope_ * points_[i].device - intercept_);
}

Duration ClockMapper::error_at(double device) const noexcept {
  const auto spread = static_cast<double>(options_.delay_spread.ns());
  const double span = points_[count_ - 1].device - points_[0].device;
  // The two ends of the hull's edge may each be late by what other bins are above the line, or by as much as is usual while there are few.
  constexpr std::size_t kEnough = 8;
  const double late = count_ < kEnough ? spread : std::min(spread, 2 * worst_);
  const double outside = std::max(0.0, device - points_[count_ - 1].device);
  const double turn = span > 0 ? std::min(options_.drift_bound, late / span) : options_.drift_bound;
  const double inside = span > 0 ? 0 : options_.drift_bound * std::abs(device - points_[0].device);
  return options_.resolution + rounded(late + turn * outside + inside);
}

}  // namespace vergence
