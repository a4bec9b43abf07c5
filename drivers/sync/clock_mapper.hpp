#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

#include "drivers/device.hpp"

namespace vergence {

struct ClockMapperOptions {
  Duration least_delay{};                             // from measurement to arrival at best, as the transport states it
  Duration delay_spread = Duration::milliseconds(2);  // by how much a delay usually exceeds it: the error bound while little is known
  Duration resolution = Duration::microseconds(1);    // of the device's stamps
  double drift_bound = 200e-6;                        // |rate − 1| of the device's clock against the host's, crystals keep 100 ppm
  Duration jump = Duration::milliseconds(20);         // a stamp that far ahead of what is possible is a clock that was set
  Duration stall = Duration::milliseconds(500);       // one that far behind is a stall, or such a clock after kBehind of them
};

/// A stamp on the host's clock.
struct MappedStamp {
  HostStamp host{};
  Duration error{};  // |true − host| is below this
};

/// Ties a device's clock to the host's: offset and drift from pairs of device stamp and arrival.
///
/// Method   Arrivals are late, never early: the line under all points (host − device against device) is the clock. Every kBin of device
///          time keeps its least-delayed pair, kBins of them are held; the line is the edge of their lower convex hull under the mean,
///          its slope held within the drift bound.
/// Threads  One caller. Memory: fixed. Time: constant a call, at most kBins points.
/// Units    Integer nanoseconds in and out; doubles only for differences within the window (exact to a nanosecond below 100 days).
/// Errors   None. A clock that was set begins a new fit (`resets`).
class ClockMapper {
 public:
  explicit ClockMapper(const ClockMapperOptions& options) noexcept : options_(options) {}

  /// Takes a pair into the fit and says when the device measured. Pairs in the order of the device's stamps.
  [[nodiscard]] MappedStamp map(DeviceStamp device, HostStamp arrival) noexcept;

  /// Takes a question and its answer into the fit: the host sent at t1, the device received at t2 and answered at t3, the host received
  /// at t4. Bounds the offset from both sides; from the first one on map() takes nothing in any more, it only says what the fit does.
  /// Of pings whose t4 < t1 or t3 < t2 nothing is believed.
  void ping(HostStamp t1, DeviceStamp t2, DeviceStamp t3, HostStamp t4) noexcept;
  /// The host's time of any stamp, without taking anything in. Precondition: known().
  [[nodiscard]] MappedStamp at(DeviceStamp device) const noexcept;
  [[nodiscard]] bool known() const noexcept { return count_ > 0; }

  /// Rate of the host's clock over the device's, minus 1; 0 before the second bin.
  [[nodiscard]] double drift() const noexcept { return slope_; }
  /// Times that the device's clock was found to have been set.
  [[nodiscard]] std::uint64_t resets() const noexcept { return resets_; }
  /// Forgets everything: the device was restarted.
  void restart() noexcept { count_ = 0, behind_ = 0, lagging_ = 0, slope_ = 0, intercept_ = 0; }

 private:
  static constexpr std::size_t kBins = 64;  // of kBin: a minute, over which a crystal's rate holds to 1e-8
  static constexpr Duration kBin = Duration::seconds(1);
  static constexpr int kBehind = 3;    // in a row beyond `stall`: the clock was set back
  static constexpr int kLagging = 16;  // in a row beyond `jump`: no transport stays congested so evenly

  struct Point {
    double device = 0;  // ns since origin_
    double delay = 0;   // ns, arrival − device − least_delay, less the one at the origin
  };
  void begin(DeviceStamp device, HostStamp arrival) noexcept;
  void take(const Point& p) noexcept;
  void fit() noexcept;
  [[nodiscard]] Duration error_at(double device) const noexcept;

  ClockMapperOptions options_;
  DeviceStamp origin_{};
  HostStamp host_origin_{};            // least-delayed guess of the host's time at origin_
  std::array<Point, kBins> points_{};  // oldest first
  std::size_t count_ = 0;
  std::int64_t newest_bin_ = 0;
  double slope_ = 0, intercept_ = 0;  // host − host_origin_ = device·(1 + slope) + intercept, ns
  double worst_ = 0;                  // ns, largest distance of a held point above the line
  int behind_ = 0, lagging_ = 0;
  std::uint64_t resets_ = 0;
};

}  // namespace vergence
