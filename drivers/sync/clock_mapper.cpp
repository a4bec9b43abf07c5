#include "drivers/sync/clock_mapper.hpp"

#include <algorithm>
#include <cmath>

namespace vergence {
namespace {

// In ns: after a day without data the old rate is meaningless.
constexpr double kStale = 86'400e9;
// Multiple of the mean; one exponential delay in a thousand is longer.
constexpr double kTail = 7;

Duration rounded(double ns) noexcept { return Duration::nanoseconds(std::llround(ns)); }
double in_ns(Duration d) noexcept { return static_cast<double>(d.ns()); }

/// Exceeds the distance of any two stamps of a run.
template <class Stamp>
bool absurd(Stamp a, Stamp b) noexcept {
  constexpr std::int64_t kCentury = 3'155'760'000'000'000'000;
  std::int64_t apart = 0;
  return __builtin_sub_overflow(a.ns(), b.ns(), &apart) || apart > kCentury || apart < -kCentury;
}

}  // namespace

void ClockMapper::restart() noexcept {
  upper_.count = lower_.count = 0;
  two_way_ = false;
  behind_ = lagging_ = 0;
  slope_ = intercept_ = 0;
}

void ClockMapper::begin(DeviceStamp device, HostStamp host) noexcept {
  restart();
  origin_ = device;
  host_origin_ = host;
  worst_ = room_ = farthest_ = turn_ = 0;
  pairs_ = 0;
}

/// Moves the origin by a whole number of bins, so that no stamp moves: doubles hold nanoseconds for
/// a hundred days only.
void ClockMapper::anchor_near(DeviceStamp device) noexcept {
  // In bins: twelve days.
  constexpr std::int64_t kFar = 1'000'000;
  const std::int64_t bins = (device - origin_).ns() / kBin.ns();
  if (bins < kFar && bins > -kFar) return;
  const Duration shift = kBin * bins;
  origin_ = origin_ + shift;
  host_origin_ = host_origin_ + shift;
  for (Points* points : {&upper_, &lower_}) {
    for (std::size_t i = 0; i < points->count; ++i) points->at[i].device -= in_ns(shift);
    points->newest_bin -= bins;
  }
  intercept_ += slope_ * in_ns(shift);
}

ClockMapper::Point ClockMapper::point(DeviceStamp device, HostStamp host) const noexcept {
  const Duration since = device - origin_;
  return {in_ns(since), in_ns((host - host_origin_) - since)};
}

bool ClockMapper::far_off(DeviceStamp device, HostStamp host) const noexcept {
  return absurd(device, origin_) || absurd(host, host_origin_);
}

bool ClockMapper::add_bound(Points* points, const Point& p, double side) const noexcept {
  const auto bin = static_cast<std::int64_t>(std::floor(p.device / in_ns(kBin)));
  if (points->count > 0 && bin <= points->newest_bin) {
    // Delays are compared along the line, so that drift inside the bin has no influence.
    Point& held = points->at[points->count - 1];
    if (side * ((p.delay - slope_ * p.device) - (held.delay - slope_ * held.device)) >= 0)
      return false;
    held = p;
    return true;
  }
  points->newest_bin = bin;
  std::size_t old = points->count == kBins ? 1 : 0;
  while (old < points->count && p.device - points->at[old].device > kStale) ++old;
  if (old > 0) {
    std::move(points->at.begin() + static_cast<std::ptrdiff_t>(old),
              points->at.begin() + static_cast<std::ptrdiff_t>(points->count), points->at.begin());
    points->count -= old;
  }
  points->at[points->count++] = p;
  return true;
}

MappedStamp ClockMapper::at(DeviceStamp device) const noexcept {
  const double since = in_ns(device - origin_);
  return {host_origin_ + (device - origin_) + rounded(line(since)), error_at(since)};
}

// ---- one way ----

MappedStamp ClockMapper::begin_one_way(DeviceStamp device, HostStamp arrival) noexcept {
  begin(device, arrival - options_.min_delay);
  (void)add_bound(&upper_, {0, 0}, 1);
  pairs_ = 1;
  return at(device);
}

MappedStamp ClockMapper::map(DeviceStamp device, HostStamp arrival) noexcept {
  if (two_way_)
    return absurd(device, origin_)
               ? MappedStamp{arrival - options_.min_delay, options_.delay_spread + options_.stall}
               : at(device);
  const HostStamp host = arrival - options_.min_delay;
  if (!known()) return begin_one_way(device, arrival);
  if (far_off(device, host)) {
    ++resets_;
    return begin_one_way(device, arrival);
  }
  anchor_near(device);
  const Point p = point(device, host);
  const double newest = upper_.at[upper_.count - 1].device;
  const double above = p.delay - line(p.device);
  // Allows for the possible drift since the newest pair.
  const double silent = std::max(0.0, p.device - newest);
  if (above < -(in_ns(options_.jump) + 2 * options_.drift_bound * silent)) {
    ++resets_;
    return begin_one_way(device, arrival);
  }
  if (above > in_ns(options_.stall) || p.device < newest - 2 * in_ns(kBin)) {
    // This is a stall or a clock that was set back. Delayed data arrive together; stamps of a clock
    // that was set back arrive as evenly as before.
    if (behind_++ == 0) first_behind_ = device, first_behind_host_ = host;
    const bool evenly = 2 * in_ns(host - first_behind_host_) >= in_ns(device - first_behind_);
    if (behind_ >= kBehind && evenly) {
      ++resets_;
      return begin_one_way(device, arrival);
    }
    // Until that is known, a stamp that runs back is bounded only by its arrival; any other was
    // measured between the fit's result and the arrival.
    if (p.device <= newest) return {host, options_.delay_spread + options_.stall};
    const MappedStamp fitted = at(device);
    return {fitted.host, fitted.error + (host - fitted.host)};
  }
  behind_ = 0;
  lagging_ = above > in_ns(options_.jump) ? lagging_ + 1 : 0;
  if (lagging_ >= kLagging) {
    ++resets_;
    return begin_one_way(device, arrival);
  }
  ++pairs_;
  if (add_bound(&upper_, p, 1)) fit_one_way();
  return at(device);
}

void ClockMapper::fit_one_way() noexcept {
  const auto& points = upper_.at;
  const std::size_t count = upper_.count;
  double mean = 0;
  for (std::size_t i = 0; i < count; ++i) mean += points[i].device / static_cast<double>(count);
  // Lower convex hull, left to right (Andrew's monotone chain), because points ascend in device
  // time.
  std::array<std::size_t, kBins> hull{};
  std::size_t n = 0;
  const auto below = [&](const Point& a, const Point& b, const Point& c) {
    return (b.device - a.device) * (c.delay - a.delay) -
               (b.delay - a.delay) * (c.device - a.device) <=
           0;
  };
  for (std::size_t i = 0; i < count; ++i) {
    while (n >= 2 && below(points[hull[n - 2]], points[hull[n - 1]], points[i])) --n;
    hull[n++] = i;
  }
  slope_ = 0;
  for (std::size_t i = 0; i + 1 < n; ++i) {
    const Point &a = points[hull[i]], &b = points[hull[i + 1]];
    if (b.device > a.device) slope_ = (b.delay - a.delay) / (b.device - a.device);
    if (b.device >= mean) break;
  }
  slope_ = std::clamp(slope_, -options_.drift_bound, options_.drift_bound);
  intercept_ = points[0].delay - slope_ * points[0].device;
  for (std::size_t i = 1; i < count; ++i)
    intercept_ = std::min(intercept_, points[i].delay - slope_ * points[i].device);
  worst_ = 0;
  for (std::size_t i = 0; i < count; ++i)
    worst_ = std::max(worst_, points[i].delay - line(points[i].device));
}

// ---- two ways ----

void ClockMapper::begin_two_way(HostStamp t1, DeviceStamp t2, DeviceStamp t3,
                                HostStamp t4) noexcept {
  begin(t2, t1 + ((t4 - t1) - (t3 - t2)) / 2);
  two_way_ = true;
  (void)add_bound(&lower_, point(t2, t1), -1);
  (void)add_bound(&upper_, point(t3, t4), 1);
  pairs_ = 1;
  fit_two_way();
}

void ClockMapper::ping(HostStamp t1, DeviceStamp t2, DeviceStamp t3, HostStamp t4) noexcept {
  if (t4 < t1 || t3 < t2 || absurd(t4, t1) || absurd(t3, t2)) return;
  const double there = in_ns(t3 - t2), slack = 2 * in_ns(options_.resolution) + 1;
  if (in_ns(t4 - t1) < there * (1 - options_.drift_bound) - slack) return;
  if (!two_way_) return begin_two_way(t1, t2, t3, t4);
  if (far_off(t2, t1) || far_off(t3, t4)) {
    ++resets_;
    return begin_two_way(t1, t2, t3, t4);
  }
  anchor_near(t2);
  const Point early = point(t2, t1), late = point(t3, t4);
  const double newest = upper_.at[upper_.count - 1].device;
  // Both bounds are hard, so a clock that was set is detected immediately in either direction;
  // smaller steps appear in the room between the bounds.
  const double silent = std::max(0.0, late.device - newest);
  const double margin = in_ns(options_.jump) + 2 * options_.drift_bound * silent;
  const bool stepped =
      late.delay < line(late.device) - margin || early.delay > line(early.device) + margin;
  if (stepped || late.device < newest - 2 * in_ns(kBin)) {
    ++resets_;
    return begin_two_way(t1, t2, t3, t4);
  }
  ++pairs_;
  const bool raised = add_bound(&lower_, early, -1), lowered = add_bound(&upper_, late, 1);
  if (!raised && !lowered) return;
  fit_two_way();
  // In ns; more than a crystal's rate bends the line within the window.
  constexpr double kBent = 100e3;
  if (room_ < -(kBent + slack)) {
    ++resets_;
    begin_two_way(t1, t2, t3, t4);
  }
}

/// Finds the slope b with the most room between parallel lines under all upper and above all lower
/// points. The room, min(U − b·x) − max(L − b·x), is concave in b; its derivative is the position
/// of the lower line's support minus that of the upper line's.
void ClockMapper::fit_two_way() noexcept {
  // Halvings of the drift bound, down to 1e-16.
  constexpr int kHalvings = 40;
  // In ns; a shorter window shows more noise than rate.
  constexpr double kEnough = 2e9;
  const auto support = [](const Points& points, double slope, double side) {
    std::size_t best = 0;
    for (std::size_t i = 1; i < points.count; ++i) {
      const Point &p = points.at[i], &q = points.at[best];
      if (side * ((p.delay - slope * p.device) - (q.delay - slope * q.device)) < 0) best = i;
    }
    return points.at[best];
  };
  double low = -options_.drift_bound, high = options_.drift_bound;
  const bool enough = upper_.at[upper_.count - 1].device - upper_.at[0].device >= kEnough;
  for (int i = 0; enough && i < kHalvings; ++i) {
    const double middle = (low + high) / 2;
    (support(lower_, middle, -1).device > support(upper_, middle, 1).device ? low : high) = middle;
  }
  slope_ = (low + high) / 2;
  const Point u = support(upper_, slope_, 1), l = support(lower_, slope_, -1);
  const double above = u.delay - slope_ * u.device, below = l.delay - slope_ * l.device;
  room_ = above - below;
  intercept_ = (above + below) / 2;
  bound_two_way();
}

/// Finds the largest difference between the chosen line and a line within the bounds, at the newest
/// point and in slope.
void ClockMapper::bound_two_way() noexcept {
  const double at =
      std::max(upper_.at[upper_.count - 1].device, lower_.at[lower_.count - 1].device);
  // Bounds of true − chosen: at most `over` at an upper point, at least −over at a lower one; the
  // slope is limited by the drift bound.
  double rise = options_.drift_bound - slope_, fall = options_.drift_bound + slope_;
  for (std::size_t i = 0; i < lower_.count; ++i) {
    const Point& l = lower_.at[i];
    const double below = std::max(0.0, line(l.device) - l.delay);
    for (std::size_t j = 0; j < upper_.count; ++j) {
      const Point& u = upper_.at[j];
      const double apart = u.device - l.device,
                   turn = (std::max(0.0, u.delay - line(u.device)) + below) / std::abs(apart);
      if (apart > 0) rise = std::min(rise, turn);
      if (apart < 0) fall = std::min(fall, turn);
    }
  }
  // The optimum is where the steepest slope touches the tightest point.
  double highest = 0, lowest = 0;
  for (std::size_t i = 0; i < upper_.count; ++i) {
    const Point& u = upper_.at[i];
    const double reach = std::max(0.0, u.delay - line(u.device)) + rise * (at - u.device);
    highest = i == 0 ? reach : std::min(highest, reach);
  }
  for (std::size_t i = 0; i < lower_.count; ++i) {
    const Point& l = lower_.at[i];
    const double reach = std::max(0.0, line(l.device) - l.delay) + fall * (at - l.device);
    lowest = i == 0 ? reach : std::min(lowest, reach);
  }
  farthest_ = std::max(highest, lowest);
  turn_ = std::max(rise, fall);
}

// ---- both ----

Duration ClockMapper::error_at(double device) const noexcept {
  const Point &first = upper_.at[0], &newest = upper_.at[upper_.count - 1];
  const double span = newest.device - first.device;
  if (two_way_) {
    // In 1/ns: a crystal's rate changes by 1 ppm per minute.
    constexpr double kBend = 2e-8 * 1e-9;
    const double at = std::max(newest.device, lower_.at[lower_.count - 1].device);
    return options_.resolution +
           rounded(farthest_ + turn_ * std::abs(device - at) + kBend * span * span / 8);
  }
  const double spread = in_ns(options_.delay_spread);
  // Either end of the hull's edge may be late by the excess of other bins over the line, or by the
  // usual spread while there are few.
  constexpr std::size_t kEnough = 8;
  const double few = spread * std::max(1.0, kTail / static_cast<double>(pairs_));
  const double late = upper_.count < kEnough ? few : std::min(spread, 2 * worst_);
  const double outside = std::max(0.0, device - newest.device);
  const double turn = span > 0 ? std::min(options_.drift_bound, late / span) : options_.drift_bound;
  const double inside = span > 0 ? 0 : options_.drift_bound * std::abs(device - first.device);
  return options_.resolution + rounded(late + turn * outside + inside);
}

}  // namespace vergence
