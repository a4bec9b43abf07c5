#pragma once

namespace vergence {

/// What the window moved a frame's fitted pose by. What was wrong in its older frames it takes back
/// in the newest one's motion, at one step, and that motion is off by it. It cannot be relied on
/// where that is both the larger part of what the motion can be off by and enough of the motion to
/// matter.
///
/// Of the recorded drives, untouched, the largest of those beyond the sigma is 4.0 % of its motion
/// (build/bench/covariance_bench). Threads: a value.
struct WindowCorrection {
  static constexpr double kShare = 0.05;

  double moved_m = 0;
  double step_m = 0;   // the motion since the last pose
  double sigma_m = 0;  // of that motion, as it is published: three times its fit's

  [[nodiscard]] bool significant() const noexcept { return moved_m > sigma_m; }
  [[nodiscard]] bool spoils_motion() const noexcept {
    return significant() && moved_m > kShare * step_m;
  }
};

}  // namespace vergence
