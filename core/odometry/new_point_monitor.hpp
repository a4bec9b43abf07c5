#pragma once
#include "core/math/robust.hpp"
#include "core/odometry/pose_estimator.hpp"

namespace vergence::odometry {

/// Detects that most new points do not fit the pose: if the pose follows an object that moves in
/// front of the scene, new points are lost immediately. Not thread-safe. Does not allocate.
class NewPointMonitor {
 public:
  /// Adds the numbers of new points searched for in a frame and found at rest. Numbers are summed
  /// over frames, so that one blurred frame does not decide.
  void add(int tried, int kept) noexcept {
    tried_ += tried;
    kept_ += kept;
    if (tried_ < static_cast<int>(kMinTracksOfFrame)) return;
    lost_ = kept_ < kMinSeenAgain * tried_;
    tried_ = kept_ = 0;
  }
  /// True if the last evaluated points were mostly lost.
  [[nodiscard]] bool lost() const noexcept { return lost_; }
  /// Call when the map is rebuilt.
  void reset() noexcept { *this = {}; }

 private:
  // Numbers of points since the last evaluation.
  int tried_ = 0, kept_ = 0;
  bool lost_ = false;
};

}  // namespace vergence::odometry
