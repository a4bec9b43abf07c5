#pragma once

namespace vergence::odometry {

/// Whether much of what is seen moves by itself, or is what the pose follows instead of the scene.
///
/// Points disagree with the motion; or those made lately do not fit it: where the pose follows what
/// moves in front of the scene they are lost as soon as they are made. What drives past looks like
/// the scene for single frames, so ten at a time are told.
/// Threads  One. Memory: none of the heap.
class MovingScene {
 public:
  /// New points that were looked for in a frame, and how many of them were found where they should
  /// be. Few at a time are judged together: else one blurred frame's verdict stood until many came
  /// at once.
  void add(int tried, int kept) noexcept {
    tried_ += tried;
    kept_ += kept;
    if (tried_ < kEnough) return;
    new_lost_ = kept_ < kKept * tried_;
    tried_ = kept_ = 0;
  }
  /// Of every frame with a pose, after its new points: is it to be told? `linked`: new points are
  /// made by a calibration, and can be judged.
  [[nodiscard]] bool judge(bool points_disagree, bool linked) noexcept {
    now_ = points_disagree || (linked && new_lost_);
    if (frames_left_ > 0) --frames_left_;
    return now_ || frames_left_ > 0;
  }
  /// The frame judged last had no other reason, such as a gap, after which points disagree, too.
  void tell() noexcept {
    if (now_) frames_left_ = kFrames;
  }
  /// The map is made anew; what moves is still there.
  void forget_points() noexcept {
    tried_ = kept_ = 0;
    new_lost_ = false;
  }

 private:
  static constexpr int kFrames = 10;
  static constexpr int kEnough = 30;  // to judge from
  // Half to nine in ten are found where the scene stands, a twentieth where the pose follows what
  // moves in front of it.
  static constexpr double kKept = 0.3;

  int tried_ = 0, kept_ = 0;  // since they were judged
  bool new_lost_ = false;     // most of those judged last
  bool now_ = false;          // the frame judged last, by itself
  int frames_left_ = 0;       // to be told, from the one that began it
};

}  // namespace vergence::odometry
