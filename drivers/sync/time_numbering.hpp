#pragma once
#include <array>
#include <cstdint>
#include <optional>

#include "core/types/calibration.hpp"
#include "drivers/sync/open_sets.hpp"
#include "drivers/sync/sync_types.hpp"

namespace vergence {

/// Numbers sets by stamps of one clock, in the modes that pair by time.
///
/// An image within the tolerance of an open set belongs to it. Any other begins a set, numbered by
/// the intervals from the newest set. An image before the first set or between two open ones
/// belongs to none.
///
/// Astray   A frame further back than any delay, or more than an hour of intervals ahead, has
///          another clock. If several in a row are astray, of any cameras, the common clock was
///          set: a new count begins at the next number, and open sets do not wait for it. If other
///          cameras' frames fit meanwhile, this camera's clock is apart.
/// Units    Times are ns of the pairing clock: the host's, the bus's or PTP's.
///
/// Not thread-safe. Does not allocate. Constant time per call.
class TimeNumbering {
 public:
  struct Number {
    /// None, or one that was already output, if the image is too late.
    std::optional<std::uint64_t> number;
    bool clock_set = false;
  };

  explicit TimeNumbering(const SyncOptions& options) noexcept
      : mode_(options.mode), interval_(options.interval), tolerance_(options.tolerance) {}

  /// Middle of the exposure on the pairing clock. The bus clock wraps; of the possible values the
  /// one nearest to the newest set is used.
  [[nodiscard]] std::int64_t time_of(const SyncFrame& frame, const OpenSets& sets) const noexcept;
  /// Number of the open set that fits, or of a new one in order of time. Flushes the sets if the
  /// clock was set.
  [[nodiscard]] Number number_of(std::size_t camera, std::int64_t time, OpenSets* sets) noexcept;
  /// True if this camera's newest frames are all astray while others' fit.
  [[nodiscard]] bool apart(std::size_t camera) const noexcept {
    return astray_[camera] >= kMinConsistent;
  }

 private:
  // Frames in a row, to exclude single corrupt stamps.
  static constexpr int kMinConsistent = 3;

  [[nodiscard]] std::optional<std::uint64_t> place(std::int64_t time,
                                                   const OpenSets& sets) const noexcept;

  SyncMode mode_;
  Duration interval_, tolerance_;
  // Number of newest frames that are astray, by camera.
  std::array<int, kMaxCameras> astray_{};
  // Number of astray frames in a row, of all cameras.
  int astray_in_a_row_ = 0;
};

}  // namespace vergence
