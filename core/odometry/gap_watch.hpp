#pragma once
#include <optional>

#include "core/types/time.hpp"

namespace vergence::odometry {

/// Gaps between frames, too long to predict the motion over, and what they leave to be done.
///
/// After a gap the scene is due to be made anew: the few points that the map still knows are seen
/// from where the rig now is by one frame alone, and a window that holds to them takes back over
/// many frames what the pose across the gap was off by. Where every interval is a gap the window is
/// all there is, and stays.
/// Threads  One. Memory: none of the heap.
class GapWatch {
 public:
  /// Of every frame: seconds since the one before; 0: there was none.
  [[nodiscard]] double since_frame(Stamp frame) noexcept {
    const double since = last_ ? (frame - *last_).to_seconds() : 0;
    last_ = frame;
    return since;
  }
  /// A frame `dt` seconds after the last pose, or after the last frame where that showed something
  /// and had no pose. `renew`: the scene could be made anew. → dt where it is a gap, else 0
  [[nodiscard]] double note(double dt, double longest, bool renew) noexcept {
    const bool gap = dt > longest;
    if (gap && !before_ && renew) due_ = true;
    before_ = gap;
    return gap ? dt : 0;
  }
  [[nodiscard]] bool renewal_due() const noexcept { return due_; }
  /// The scene is new, or of another kind.
  void forget() noexcept { due_ = false; }

 private:
  std::optional<Stamp> last_{};
  bool before_ = false;  // the newest frame came after a gap
  bool due_ = false;
};

}  // namespace vergence::odometry
