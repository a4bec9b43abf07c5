#pragma once

namespace vergence::odometry {

/// Detects that most of the points made lately do not fit the pose: if the pose follows an object
/// that moves in front of the scene, new points are lost as soon as they are made. Not thread-safe.
/// Does not allocate.
class NewPointMonitor {
 public:
  /// Adds the number of new points searched for in a frame and the number found at rest in the
  /// scene. Small numbers are summed over frames before they are evaluated, so that one blurred
  /// frame does not decide.
  void add(int tried, int kept) noexcept {
    tried_ += tried;
    kept_ += kept;
    if (tried_ < kEnough) return;
    lost_ = kept_ < kKept * tried_;
    tried_ = kept_ = 0;
  }
  /// True if the points evaluated last were mostly lost.
  [[nodiscard]] bool lost() const noexcept { return lost_; }
  /// Call when the map is made anew.
  void reset() noexcept { *this = {}; }

 private:
  static constexpr int kEnough = 30;  // to judge from
  // Half to nine in ten are found where the scene stands, a twentieth where the pose follows what
  // moves in front of it.
  static constexpr double kKept = 0.3;

  int tried_ = 0, kept_ = 0;  // since they were judged
  bool lost_ = false;
};

}  // namespace vergence::odometry
