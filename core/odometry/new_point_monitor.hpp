#pragma once

namespace vergence::odometry {

/// Whether most of the points made lately do not fit the pose but another motion. Where the pose
/// follows what moves in front of the scene they are lost as soon as they are made. Threads  One.
/// Memory: none of the heap.
class NewPointMonitor {
 public:
  /// New points that were looked for in a frame, and how many of them do not move by themselves.
  /// Few at a time are judged together: else one blurred frame's verdict stood until many came at
  /// once.
  void add(int tried, int kept) noexcept {
    tried_ += tried;
    kept_ += kept;
    if (tried_ < kEnough) return;
    lost_ = kept_ < kKept * tried_;
    tried_ = kept_ = 0;
  }
  /// Of those judged last.
  [[nodiscard]] bool lost() const noexcept { return lost_; }
  /// The map is made anew.
  void forget() noexcept { *this = {}; }

 private:
  static constexpr int kEnough = 30;  // to judge from
  // Half to nine in ten are found where the scene stands, a twentieth where the pose follows what
  // moves in front of it.
  static constexpr double kKept = 0.3;

  int tried_ = 0, kept_ = 0;  // since they were judged
  bool lost_ = false;
};

}  // namespace vergence::odometry
