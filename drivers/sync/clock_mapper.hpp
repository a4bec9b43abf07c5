#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

#include "drivers/device.hpp"

namespace vergence {

struct ClockMapperOptions {
  /// Minimum delay from measurement to arrival, as the transport states it.
  Duration min_delay{};
  Duration delay_spread = Duration::milliseconds(
      2);  // by how much a delay exceeds it on average: the error bound while little is known
  /// Resolution of the device's stamps.
  Duration resolution = Duration::microseconds(1);
  /// Bound of |rate − 1| of the device's clock against the host's; crystals keep 100 ppm.
  double drift_bound = 200e-6;
  Duration jump = Duration::milliseconds(
      20);  // a stamp that far ahead of what is possible is a clock that was set
  Duration stall = Duration::milliseconds(
      500);  // one that far behind is a stall, or such a clock after kBehind of them
};

/// A stamp on the host's clock.
struct MappedStamp {
  HostStamp host{};
  /// Upper bound of |true − host|.
  Duration error{};
};

/// Ties a device's clock to the host's: offset and drift, from pairs of device stamp and arrival,
/// or from questions and answers.
///
///     ClockMapper clock({.min_delay = Duration::microseconds(300)});
///     const MappedStamp mapped = clock.map(frame.exposure_start, frame.arrival);
///     use(mapped.host, mapped.error);
///
/// One way    Arrivals are late, never early: the line under all points (host − device against
///            device) is the clock. Every kBin of device time keeps its least-delayed pair, kBins
///            of them are held; the line is the edge of their lower convex hull under the mean, its
///            slope held within the drift bound. The true minimum delay cannot be observed one way:
///            an error of the stated one (`min_delay`) shifts all stamps, beyond the bound.
/// Two ways   A question puts the line above a point, its answer below one. Of the slopes the one
///            is taken that leaves the most room between those bounds, and the line in the middle
///            of it: right where both ways are alike at their best. The error bound holds for any
///            least delays, also unlike ones: it is the farthest that a line may be which keeps to
///            all bounds (a linear programme of two unknowns), plus what the rate may change within
///            the window.
/// Not thread-safe. Fixed memory. Time: constant a call; a call that tightens a bound takes
///            at most kBins² steps.
/// Units      Integer nanoseconds in and out; doubles only for differences within the window: exact
///            whatever the clocks' origins are, and however long they run.
/// Errors     None. A clock that was set begins a new fit (`resets`).
class ClockMapper {
 public:
  explicit ClockMapper(const ClockMapperOptions& options) noexcept : options_(options) {}

  /// Takes a pair into the fit and says when the device measured. Pairs in the order of the
  /// device's stamps.
  [[nodiscard]] MappedStamp map(DeviceStamp device, HostStamp arrival) noexcept;
  /// Takes a question and its answer into the fit: the host sent at t1, the device received at t2
  /// and answered at t3, the host received at t4. In the order of the device's stamps. From the
  /// first one on map() takes nothing in any more, it only says what the fit does. A ping that took
  /// less time here than there (t4 − t1 < t3 − t2, but for the drift), or less than none, is not
  /// believed.
  void ping(HostStamp t1, DeviceStamp t2, DeviceStamp t3, HostStamp t4) noexcept;
  /// The host's time of any stamp, without taking anything in. Precondition: known().
  [[nodiscard]] MappedStamp at(DeviceStamp device) const noexcept;
  [[nodiscard]] bool known() const noexcept { return upper_.count > 0; }

  /// Rate of the host's clock over the device's, minus 1; 0 before the second bin.
  [[nodiscard]] double drift() const noexcept { return slope_; }
  /// Times that the device's clock was found to have been set.
  [[nodiscard]] std::uint64_t resets() const noexcept { return resets_; }
  /// Forgets everything: the device was restarted.
  void restart() noexcept;

 private:
  static constexpr std::size_t kBins =
      64;  // of kBin: a minute, over which a crystal's rate holds to 1e-8
  static constexpr Duration kBin = Duration::seconds(1);
  static constexpr int kBehind = 3;  // in a row beyond `stall`, not all at once: it was set back
  static constexpr int kLagging =
      16;  // in a row beyond `jump`: no transport stays congested so evenly

  struct Point {
    double device = 0;  // ns since origin_
    double delay = 0;  // ns, (host − host_origin_) − (device − origin_): on the line at best, late
                       // above it, early below it
  };
  /// One point a bin, oldest first.
  struct Points {
    std::array<Point, kBins> at{};
    std::size_t count = 0;
    std::int64_t newest_bin = 0;
  };

  void begin(DeviceStamp device, HostStamp host) noexcept;
  [[nodiscard]] MappedStamp begin_one_way(DeviceStamp device, HostStamp arrival) noexcept;
  void begin_two_way(HostStamp t1, DeviceStamp t2, DeviceStamp t3, HostStamp t4) noexcept;
  void anchor_near(DeviceStamp device) noexcept;
  [[nodiscard]] Point point(DeviceStamp device, HostStamp host) const noexcept;
  [[nodiscard]] bool far_off(DeviceStamp device, HostStamp host) const noexcept;
  /// True: it is the best of its bin, so that the line may change. `side` +1: smaller delays are
  /// better, −1: greater ones.
  bool take(Points* points, const Point& p, double side) const noexcept;
  [[nodiscard]] double line(double device) const noexcept { return intercept_ + slope_ * device; }
  void fit_one_way() noexcept;
  void fit_two_way() noexcept;
  void bound_two_way() noexcept;
  [[nodiscard]] Duration error_at(double device) const noexcept;

  ClockMapperOptions options_;
  bool two_way_ = false;
  DeviceStamp origin_{};
  HostStamp host_origin_{};
  Points upper_{}, lower_{};          // the line is below all of upper, above all of lower
  double slope_ = 0, intercept_ = 0;  // ns: delay = intercept + slope · device
  double worst_ = 0;  // ns, one way: largest distance of a held point above the line
  double room_ = 0;   // ns, two ways: between the bounds, negative: no line keeps to them
  double farthest_ = 0, turn_ = 0;  // ns and 1, two ways: of a line that keeps to the bounds, at
                                    // the newest point, and in slope
  std::uint64_t pairs_ = 0;         // taken since begin()
  int behind_ = 0, lagging_ = 0;
  DeviceStamp first_behind_{};  // of those in a row, and its arrival
  HostStamp first_behind_host_{};
  std::uint64_t resets_ = 0;
};

}  // namespace vergence
