#pragma once

namespace vergence::odometry {

/// Minimum share of points that are seen where pose and rig expect them: in a static scene it is
/// 0.5 to 0.9, and 0.05 if the pose follows a moving object.
inline constexpr double kMinSeenAgain = 0.3;

/// Detects that most new points do not fit the pose: if the pose follows an object that moves in
/// front of the scene, new points are lost immediately. Not thread-safe. Does not allocate.
class NewPointMonitor {
 public:
  /// Adds the numbers of new points searched for in a frame and found at rest. Numbers are summed
  /// over frames, so that one blurred frame does not decide.
  void add(int tried, int kept) noexcept {
    tried_ += tried;
    kept_ += kept;
    if (tried_ < kEnough) return;
    lost_ = kept_ < kMinSeenAgain * tried_;
    tried_ = kept_ = 0;
  }
  /// True if the last evaluated points were mostly lost.
  [[nodiscard]] bool lost() const noexcept { return lost_; }
  /// Call when the map is rebuilt.
  void reset() noexcept { *this = {}; }

 private:
  // Minimum number of points for an evaluation.
  static constexpr int kEnough = 30;

  // Numbers of points since the last evaluation.
  int tried_ = 0, kept_ = 0;
  bool lost_ = false;
};

}  // namespace vergence::odometry
