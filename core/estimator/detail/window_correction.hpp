#pragma once

namespace vergence {

/// Correction of a frame's fitted pose by the window adjustment. When the window corrects errors of
/// older frames, the correction appears as a jump in the newest motion. The motion is unreliable if
/// the jump exceeds both its own sigma and the share kShare of its length.
///
/// On the recorded drives without faults the largest jump beyond the sigma is 4.0 % of its motion
/// (build/bench/covariance_bench).
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
