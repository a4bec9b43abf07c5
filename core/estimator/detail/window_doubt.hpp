#pragma once
#include <algorithm>

#include "core/types/pose_sample.hpp"

namespace vergence {

/// What was wrong for some frames stays in the window's keyframes and points when it is over: the
/// window takes it back over the next frames, and their motions are off by it. So a pose about
/// which nothing else is doubted is not `ok` before as many frames as were doubted have passed, of
/// a window at most.
///
/// Threads  One. Memory: none of the heap.
class WindowDoubt {
 public:
  // Frames: the default of odometry.window_keyframes; at speed each frame is a keyframe.
  static constexpr int kWindow = 10;

  /// So many more frames of the window are doubted, and why.
  void add(Reason why, int frames) noexcept {
    why_ = why;
    left_ = std::min(left_ + frames, kWindow);
  }
  /// The scene is new.
  void clear() noexcept { left_ = 0; }
  /// Of a frame that is not doubted itself: why its window is; none: it is not.
  [[nodiscard]] Reason next() noexcept {
    if (left_ == 0) return Reason::none;
    --left_;
    return why_;
  }

 private:
  Reason why_ = Reason::none;
  int left_ = 0;
};

}  // namespace vergence
