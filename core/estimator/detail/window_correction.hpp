#pragma once

namespace vergence {

/// What the window moved a frame's fitted pose by. What was wrong in its older frames it takes back
/// in the newest one's motion, at one step, and that motion is off by it. It cannot be relied on
/// where that is both more than the motion's fit can be off by and enough of the motion to matter.
///
/// Of the recorded drives, untouched, the largest of those beyond the sigmas is 3.5 % of its motion
/// (build/bench/covariance_bench). Threads: a value.
struct WindowCorrection {
  static constexpr double kSigmas = 2.5, kShare = 0.05;

  double moved_m = 0;
  double step_m = 0;   // the motion since the last pose
  double sigma_m = 0;  // of that motion's fit

  [[nodiscard]] bool significant() const noexcept { return moved_m > kSigmas * sigma_m; }
  [[nodiscard]] bool spoils_motion() const noexcept {
    return significant() && moved_m > kShare * step_m;
  }
};

}  // namespace vergence
