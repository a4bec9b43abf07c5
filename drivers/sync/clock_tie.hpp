#pragma once
#include "drivers/device.hpp"

namespace vergence {

/// The greatest difference between two crystals of 200 ppm.
inline constexpr double kMaxDrift = 400e-6;

/// A camera's clock tied to the clock of the pulses' source: a line over matched pairs of stamp and
/// edge.
///
/// Method   Expanding memory up to kMemory pairs: a g-h filter with the gains of the least-squares
///          line, g = 2(2n−1)/(n(n+1)), h = 6/(n(n+1)).
/// Not thread-safe. Fixed memory. Constant time per call.
/// Errors   None. A pair that is not later than the one before is passed over.
///
///     tie.add(frame.exposure_start, pulse.edge);
///     const bool same = magnitude(next.edge - tie.to_edge(stamp)) <= tie.gate(stamp);
class ClockTie {
 public:
  /// `noise`: by how much a stamp may be off its edge plus a constant. `interval`: of the pulses.
  ClockTie(Duration noise, Duration interval) noexcept : noise_(noise), interval_(interval) {}

  void clear() noexcept;
  void add(DeviceStamp stamp, DeviceStamp edge) noexcept;

  /// Where the stamp lies by the source's clock. Precondition: a pair was added since clear().
  [[nodiscard]] DeviceStamp to_edge(DeviceStamp stamp) const noexcept;
  /// The edge that a stamp belongs to is within this of to_edge().
  [[nodiscard]] Duration gate(DeviceStamp stamp) const noexcept;
  /// Value of the newest pair.
  [[nodiscard]] Duration gate() const noexcept { return gate(stamp_); }

 private:
  static constexpr int kMemory = 128;  // pairs: 4 s at 30 Hz

  Duration noise_, interval_;
  DeviceStamp stamp_{}, edge_{};  // the newest pair, smoothed
  double rate_ = 0;               // of the source's clock over the camera's, minus 1
  int pairs_ = 0;
};

}  // namespace vergence
