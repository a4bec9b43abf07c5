#pragma once
#include <array>
#include <cstdint>
#include <optional>

#include "core/types/calibration.hpp"
#include "drivers/sync/open_sets.hpp"
#include "drivers/sync/sync_types.hpp"

namespace vergence {

/// The numbers of sets from stamps of one clock: for the modes software, bus, ptp and side_by_side.
///
/// An image within the tolerance of an open set belongs to it; anything else begins one,
/// so many intervals after the newest or before it. What would be before the first set, or between
/// two that are open, is of none.
///
/// Astray   A frame that is farther back than any can be late, or over an hour of intervals ahead,
///          has another clock than the others. Several in a row, of whatever camera, and the common
///          clock was set: a new count begins, at the next number, and open sets do not wait
///          for it. Where other cameras' frames fit meanwhile, that camera's clock is apart.
///
/// Not thread-safe. Does not allocate. Constant time per call.
/// Units    Times are ns of the clock that pairs: the host's, the bus's, PTP's.
/// Errors   None; a clock that was set, or is apart, is told.
class TimeNumbering {
 public:
  struct Number {
    std::optional<std::uint64_t> number;  // none, or one that has gone out: too late
    bool clock_set = false;
  };

  explicit TimeNumbering(const SyncOptions& options) noexcept
      : mode_(options.mode), interval_(options.interval), tolerance_(options.tolerance) {}

  /// Middle of the exposure on the clock that pairs. The bus's wraps: of the two unwrapped by their
  /// cameras' drivers that nearest to the newest set's is meant.
  [[nodiscard]] std::int64_t time_of(const SyncFrame& frame, const OpenSets& sets) const noexcept;
  /// The number of the open set that it fits into, or a new one in the order of time. Flushes the
  /// sets where the clock was set.
  [[nodiscard]] Number number_of(std::size_t camera, std::int64_t time, OpenSets* sets) noexcept;
  /// This camera's newest frames are all astray, while others' fit.
  [[nodiscard]] bool apart(std::size_t camera) const noexcept {
    return astray_[camera] >= kBelieved;
  }

 private:
  static constexpr int kBelieved = 3;  // frames in a row: more than a stamp that is broken

  [[nodiscard]] std::optional<std::uint64_t> place(std::int64_t time,
                                                   const OpenSets& sets) const noexcept;

  SyncMode mode_;
  Duration interval_, tolerance_;
  std::array<int, kMaxCameras> astray_{};  // newest frames of each that are
  int astray_in_a_row_ = 0;                // of all cameras
};

}  // namespace vergence
