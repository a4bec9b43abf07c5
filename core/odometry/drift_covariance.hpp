#pragma once
#include "core/math/se3.hpp"

namespace vergence::odometry {

/// Maximum time for which a motion is extrapolated, in seconds; a vehicle's speed is unknown after
/// it.
inline constexpr double kLongestExtrapolation = 2.0;

/// Covariance of one frame's motion: translation (m), then rotation (rad), about the left camera's
/// axes.
///
/// It is kFitInflation² times that of the frame's fit (`fit`: left perturbation φ rad, τ m), which
/// assumes exact points, although their errors last for many frames; the factor is measured
/// (build/bench/covariance_bench). A motion extrapolated over `extrapolated_s` has a sigma of half
/// its size, plus that of the unknown motion after kLongestExtrapolation. Pure.
[[nodiscard]] Mat6 motion_covariance(const Mat6& fit, const Transform& T_now_before,
                                     double extrapolated_s) noexcept;
/// Covariance that the window's correction of a pose adds to the motion to it, because it corrects
/// errors of earlier motions. T_adjusted_fitted is FrameOutcome::corrected; translation (m), then
/// rotation (rad), about the left camera's axes. Pure.
[[nodiscard]] Mat6 correction_covariance(const Transform& T_adjusted_fitted) noexcept;

/// Returns true if a motion with covariance `motion` is consistent with standstill: within three
/// sigmas over all six components. For a standing rig it returns false once in a million frames,
/// because the covariance is inflated.
[[nodiscard]] bool may_be_none(const Transform& T_now_before, const Mat6& motion) noexcept;

/// Covariance of dead reckoning, propagated from pose to pose.
///
/// Model  Motions have independent errors and share four: a relative error of all lengths, from the
///        calibration's depth, and a rotation per metre about each axis, from lens errors. First
///        order: P ← A P Aᵀ + Q, and c ← A c + q for the shared errors, with the adjoint A of the
///        motion (Barfoot, State Estimation for Robotics, 7.3.1). Frames are measured against the
///        map: P, c and the motion refer to an anchor, the last pose that has certainly moved or
///        has changed the map, so at standstill nothing accumulates.
///
///     const Mat6 motion = motion_covariance(fit, drift.motion_to(T_left_world), 0);
///     drift.step(T_left_world, motion, 0.005, keyframe);
///     use(drift.pose());
///
/// Threads  A value; one caller. Does not allocate.
class DriftCovariance {
 public:
  /// Adds the next pose, with its motion's covariance and the relative sigma of lengths by the
  /// calibration. `map_changed`: the next poses are measured against a changed map. The first pose
  /// is exact: it defines the world.
  void step(const Transform& T_left_world, const Mat6& motion, double length_sigma,
            bool map_changed) noexcept;
  /// Returns T_now_before of the next pose; the identity before the first.
  [[nodiscard]] Transform motion_to(const Transform& T_left_world) const noexcept {
    return any_ ? T_left_world * now_.T_left_world.inverse() : Transform{};
  }
  /// Covariance of T_world_left relative to the first pose: left camera's position (m), then
  /// rotation (rad), both about the world's axes.
  [[nodiscard]] Mat6 pose() const noexcept;

 private:
  struct Pose {
    Transform T_left_world{};
    // Covariance of T_left_world by independent errors: left perturbation, translation first.
    Mat6 noise = Mat6::Zero();
    // Effect of one sigma of each shared error on T_left_world: lengths, then rotations about x, y,
    // z.
    Eigen::Matrix<double, 6, 4> shared = Eigen::Matrix<double, 6, 4>::Zero();
  };
  bool any_ = false;
  Pose now_{}, anchor_{};
};

}  // namespace vergence::odometry
