#pragma once
#include <algorithm>
#include <array>
#include <cstddef>

#include "core/types/time.hpp"

namespace vergence::odometry {

/// Detects gaps between frames that are too long for motion prediction, and requests a new scene
/// after one.
///
/// The limit follows the drive: it is a multiple of the usual interval between frames, so that a
/// steady 1 Hz has no gaps. After a gap the few surviving points constrain only one frame, and
/// keeping them would spread the gap's pose error over many frames; so a new scene is requested. If
/// every interval is a gap, no request is made.
///
/// Not thread-safe. Does not allocate.
class GapDetector {
 public:
  /// Call for every frame. Returns the seconds since the one before; 0 if there was none.
  [[nodiscard]] double since_frame(Stamp frame) noexcept {
    const double since = any_ ? (frame - last_).to_seconds() : 0;
    if (any_) intervals_[count_++ % kIntervals] = since;
    any_ = true;
    last_ = frame;
    return since;
  }
  /// A frame `dt` seconds after the last pose, or after the last frame where that showed something
  /// and had no pose. `renew`: the scene could be made anew. Returns dt where it is a gap, else 0.
  [[nodiscard]] double check(double dt, bool renew) noexcept {
    const double usual = usual_interval();
    const bool gap = usual > 0 && dt > kLongest * usual;
    if (gap && !before_ && renew) due_ = true;
    before_ = gap;
    return gap ? dt : 0;
  }
  [[nodiscard]] bool renewal_due() const noexcept { return due_; }
  /// Clears the request: the scene was made anew or replaced, or cannot be made anew.
  void clear_renewal() noexcept { due_ = false; }

 private:
  static constexpr std::size_t kIntervals = 9;  // so many of the newest make the usual one
  // Intervals. A vehicle that brakes or accelerates at 5 m/s² and has frames at 10 Hz is 0.9 m from
  // where its last motion would have it after six of them: nothing near is found there any more.
  static constexpr double kLongest = 6;

  /// The median, so that a gap has no effect unless most intervals are gaps.
  [[nodiscard]] double usual_interval() const noexcept {
    const std::size_t n = std::min(count_, kIntervals);
    if (n == 0) return 0;
    std::array<double, kIntervals> sorted = intervals_;
    const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>((n - 1) / 2);
    std::nth_element(sorted.begin(), middle, sorted.begin() + static_cast<std::ptrdiff_t>(n));
    return *middle;
  }

  bool any_ = false;  // there was a frame, at `last_`
  Stamp last_{};
  std::array<double, kIntervals> intervals_{};  // s
  std::size_t count_ = 0;                       // intervals seen
  bool before_ = false;                         // the newest frame came after a gap
  bool due_ = false;
};

}  // namespace vergence::odometry
