#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

#include "drivers/device.hpp"

namespace vergence {

struct ClockMapperOptions {
  /// Minimum delay from measurement to arrival, as stated by the transport.
  Duration min_delay{};
  /// Average excess of a delay over the minimum; the error bound as long as there are few samples.
  Duration delay_spread = Duration::milliseconds(2);
  /// Resolution of the device's stamps.
  Duration resolution = Duration::microseconds(1);
  /// Bound of |rate − 1| of the device's clock against the host's; crystals keep 100 ppm.
  double drift_bound = 200e-6;
  /// A stamp that is too early by this much means that the device's clock was set.
  Duration jump = Duration::milliseconds(20);
  /// A stamp that is too late by this much is a stall or, kBehind times in a row, a clock that was
  /// set.
  Duration stall = Duration::milliseconds(500);
};

/// A stamp on the host's clock.
struct MappedStamp {
  HostStamp host{};
  /// Upper bound of |true − host|.
  Duration error{};
};

/// Maps a device's clock to the host's: estimates offset and drift from pairs of device stamp and
/// arrival (one way) or from pings (two ways).
///
///     ClockMapper clock({.min_delay = Duration::microseconds(300)});
///     const MappedStamp mapped = clock.map(frame.exposure_start, frame.arrival);
///     use(mapped.host, mapped.error);
///
/// One way    Arrivals are late, never early, so the clock is the line under all points (host −
///            device against device). Each kBin of device time keeps the pair of minimum delay. The
///            line is the edge of their lower convex hull under the mean, its slope limited by the
///            drift bound. One way cannot observe the true minimum delay: an error of `min_delay`
///            shifts all stamps, beyond the bound.
/// Two ways   A ping bounds the line from both sides. The slope with the most room between the
///            bounds is taken, and the line in its middle, which is correct if the minimum delays
///            are equal. The error bound also holds for unequal ones: it is the largest distance of
///            a line that satisfies all bounds (a linear programme of two unknowns), plus the
///            possible change of rate within the window.
/// Cost       Not thread-safe. Fixed memory. Constant time per call; a call that tightens a bound
///            takes at most kBins² steps.
/// Units      Integer nanoseconds; doubles only for differences within the window, so the results
///            are exact regardless of the clocks' origins and uptime.
/// Errors     None. A clock that was set starts a new fit (`resets`).
class ClockMapper {
 public:
  explicit ClockMapper(const ClockMapperOptions& options) noexcept : options_(options) {}

  /// Adds a pair to the fit and maps its stamp. Pairs must be in order of the device's stamps.
  [[nodiscard]] MappedStamp map(DeviceStamp device, HostStamp arrival) noexcept;
  /// Adds a ping to the fit: the host sent at t1, the device received at t2 and answered at t3, the
  /// host received at t4. Pings must be in order of the device's stamps. After the first one map()
  /// no longer adds pairs. A ping is ignored if its round trip was negative or shorter on the host
  /// than on the device, beyond the drift.
  void ping(HostStamp t1, DeviceStamp t2, DeviceStamp t3, HostStamp t4) noexcept;
  /// Maps a stamp without adding it. Precondition: known().
  [[nodiscard]] MappedStamp at(DeviceStamp device) const noexcept;
  [[nodiscard]] bool known() const noexcept { return upper_.count > 0; }

  /// Rate of the host's clock over the device's, minus 1; 0 before the second bin.
  [[nodiscard]] double drift() const noexcept { return slope_; }
  /// Number of detected steps of the device's clock.
  [[nodiscard]] std::uint64_t resets() const noexcept { return resets_; }
  /// Discards the fit, because the device was restarted.
  void restart() noexcept;

 private:
  // Number of bins: about a minute, over which a crystal's rate is stable to 1e-8.
  static constexpr std::size_t kBins = 64;
  static constexpr Duration kBin = Duration::seconds(1);
  // Stamps in a row that are late beyond `stall` and evenly spaced after which the clock counts as
  // set back.
  static constexpr int kBehind = 3;
  // Stamps in a row that are late beyond `jump`; transport congestion is never that even.
  static constexpr int kLagging = 16;

  struct Point {
    // Device time since origin_, in ns.
    double device = 0;
    // Delay (host − host_origin_) − (device − origin_), in ns: at best on the line, late above it,
    // early below it.
    double delay = 0;
  };
  /// One point per bin, oldest first.
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
  /// Returns true if the point is the best of its bin, so that the line may change. With `side` +1
  /// smaller delays are better, with −1 greater ones.
  bool add_bound(Points* points, const Point& p, double side) const noexcept;
  [[nodiscard]] double line(double device) const noexcept { return intercept_ + slope_ * device; }
  void fit_one_way() noexcept;
  void fit_two_way() noexcept;
  void bound_two_way() noexcept;
  [[nodiscard]] Duration error_at(double device) const noexcept;

  ClockMapperOptions options_;
  bool two_way_ = false;
  DeviceStamp origin_{};
  HostStamp host_origin_{};
  // The line is below all upper points and above all lower ones.
  Points upper_{}, lower_{};
  // Line in ns: delay = intercept + slope · device.
  double slope_ = 0, intercept_ = 0;
  // One way: largest distance of a point above the line, in ns.
  double worst_ = 0;
  // Two ways: room between the bounds, in ns; negative if no line satisfies them.
  double room_ = 0;
  // Two ways: largest difference of a line that satisfies the bounds, at the newest point in ns,
  // and in slope.
  double farthest_ = 0, turn_ = 0;
  // Number of pairs since begin().
  std::uint64_t pairs_ = 0;
  int behind_ = 0, lagging_ = 0;
  // First stamp of the current run of late ones, and its arrival.
  DeviceStamp first_behind_{};
  HostStamp first_behind_host_{};
  std::uint64_t resets_ = 0;
};

}  // namespace vergence
