#pragma once
#include <algorithm>
#include <array>
#include <cstddef>

#include "core/types/time.hpp"

namespace vergence::odometry {

/// Detects gaps between frames that are too long for motion prediction, and requests a map reset
/// after one.
///
/// The limit is a multiple of the usual interval, so a steady 1 Hz has no gaps. After a gap the few
/// surviving points would spread the gap's pose error over many frames; so a new map is requested,
/// unless every interval is a gap.
///
/// Not thread-safe. Does not allocate.
class GapDetector {
 public:
  /// Call for every frame. Returns the seconds since the previous one; 0 for the first.
  [[nodiscard]] double since_frame(Stamp frame) noexcept {
    const double since = frames_ > 0 ? (frame - last_).to_seconds() : 0;
    if (frames_ > 0) intervals_[(frames_ - 1) % kIntervals] = since;
    ++frames_;
    last_ = frame;
    return since;
  }
  /// Checks a frame `dt` seconds after the last pose, or after the last frame if that had structure
  /// but no pose. `can_rebuild`: the map can be rebuilt. Returns dt if it is a gap, else 0.
  [[nodiscard]] double check(double dt, bool can_rebuild) noexcept {
    const double usual = usual_interval();
    const bool gap = usual > 0 && dt > kLongest * usual;
    if (gap && !before_ && can_rebuild) due_ = true;
    before_ = gap;
    return gap ? dt : 0;
  }
  [[nodiscard]] bool rebuild_due() const noexcept { return due_; }
  /// Clears the request, because the map was replaced or cannot be rebuilt.
  void clear_rebuild() noexcept { due_ = false; }

 private:
  // Number of newest intervals whose median is the usual one.
  static constexpr std::size_t kIntervals = 9;
  // Maximum number of usual intervals without a gap. Braking at 5 m/s² for six intervals at 10 Hz
  // deviates by 0.9 m from the prediction, so near points are no longer found.
  static constexpr double kLongest = 6;

  /// Median interval in seconds; gaps have no effect unless they are the majority.
  [[nodiscard]] double usual_interval() const noexcept {
    const std::size_t n = std::min(std::max<std::size_t>(frames_, 1) - 1, kIntervals);
    if (n == 0) return 0;
    std::array<double, kIntervals> sorted = intervals_;
    const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>((n - 1) / 2);
    std::nth_element(sorted.begin(), middle, sorted.begin() + static_cast<std::ptrdiff_t>(n));
    return *middle;
  }

  // Stamp of the last frame.
  Stamp last_{};
  // In seconds.
  std::array<double, kIntervals> intervals_{};
  std::size_t frames_ = 0;
  // True if the newest frame came after a gap.
  bool before_ = false;
  bool due_ = false;
};

}  // namespace vergence::odometry
