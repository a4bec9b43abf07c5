#pragma once

namespace vergence {

/// Correction of a frame's fitted pose by the window, which appears as a jump in the newest motion
/// when errors of older frames are corrected. The motion is unreliable if the jump exceeds both its
/// own sigma and the share kShare of its length.
///
/// On recorded sequences without faults the largest jump beyond the sigma is 4.0 % of its motion
/// (build/bench/covariance_bench).
struct WindowCorrection {
  static constexpr double kShare = 0.05;

  /// Distance by which the window moved the fitted pose.
  double moved_m = 0;
  /// Length of the motion since the last pose.
  double step_m = 0;
  /// Standard deviation of that motion, after the inflation of motion_covariance().
  double sigma_m = 0;

  [[nodiscard]] bool significant() const noexcept { return moved_m > sigma_m; }
  [[nodiscard]] bool motion_unreliable() const noexcept {
    return significant() && moved_m > kShare * step_m;
  }
};

}  // namespace vergence
