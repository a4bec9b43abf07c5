#pragma once
#include "drivers/device.hpp"

namespace vergence {

/// Maximum drift between two crystals of 200 ppm.
inline constexpr double kMaxDrift = 400e-6;

/// Relation of a camera's clock to the clock of the pulses' source: a line over matched pairs of
/// stamp and edge.
///
/// Uses an expanding-memory g-h filter of up to kMemory pairs, with the gains of the least-squares
/// line, g = 2(2n−1)/(n(n+1)), h = 6/(n(n+1)). A pair that is not later than the one before is
/// ignored. Not thread-safe. Fixed memory, constant time per call.
///
///     tie.add(frame.exposure_start, pulse.edge);
///     const bool same = magnitude(next.edge - tie.to_edge(stamp)) <= tie.gate(stamp);
class ClockTie {
 public:
  /// `noise` bounds the deviation of a stamp from its edge plus a constant; `interval` is that of
  /// the pulses.
  ClockTie(Duration noise, Duration interval) noexcept : noise_(noise), interval_(interval) {}

  void clear() noexcept;
  void add(DeviceStamp stamp, DeviceStamp edge) noexcept;

  /// Maps the stamp to the source's clock. Precondition: a pair was added since clear().
  [[nodiscard]] DeviceStamp to_edge(DeviceStamp stamp) const noexcept;
  /// Maximum distance of the stamp's edge from to_edge().
  [[nodiscard]] Duration gate(DeviceStamp stamp) const noexcept;
  /// Gate at the newest pair.
  [[nodiscard]] Duration gate() const noexcept { return gate(stamp_); }

 private:
  // Number of pairs: 4 s at 30 Hz.
  static constexpr int kMemory = 128;

  Duration noise_, interval_;
  // Newest pair, smoothed.
  DeviceStamp stamp_{}, edge_{};
  // Rate of the source's clock over the camera's, minus 1.
  double rate_ = 0;
  int pairs_ = 0;
};

}  // namespace vergence
