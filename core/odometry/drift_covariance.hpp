#pragma once
#include "core/math/se3.hpp"

namespace vergence::odometry {

inline constexpr double kLongestExtrapolation =
    2.0;  // s that a motion is carried on for: later a vehicle's speed is unknown

/// Covariance of one frame's motion, translation (m) first, then rotation (rad), about the left
/// camera's axes.
///
/// kFitInflation² times that of the frame's own fit, `fit` (left perturbation φ rad, τ m): a fit
/// holds the points as if they were known, and their errors last for many frames; the factor is
/// measured on recorded drives (build/bench/covariance_bench). A motion that was extrapolated over
/// `extrapolated_s` is off by half of itself, and by what it does not contain of the motion after
/// kLongestExtrapolation. Threads pure.
[[nodiscard]] Mat6 motion_covariance(const Mat6& fit, const Transform& T_now_before,
                                     double extrapolated_s) noexcept;
/// Covariance that the window's correction of a pose adds to the motion to it: the motion is off by
/// the correction, which belongs to earlier motions. T_adjusted_fitted as FrameOutcome::corrected;
/// translation (m) first, then rotation (rad), about the left camera's axes. Threads pure.
[[nodiscard]] Mat6 correction_covariance(const Transform& T_adjusted_fitted) noexcept;

/// Returns true if a motion with covariance `motion` is consistent with none: within three sigmas
/// in all six components together. For a standing rig it returns false once in a million frames,
/// because the covariance is inflated.
[[nodiscard]] bool may_be_none(const Transform& T_now_before, const Mat6& motion) noexcept;

/// Covariance of dead reckoning, propagated from pose to pose.
///
/// Model  Motions have independent errors. Besides, all of a drive share four: lengths are off by
///        one factor, that of the calibration's depth, and what is wrong with a lens turns the path
///        by so much a metre. First order: P ← A P Aᵀ + Q, and c ← A c + q for what is shared, with
///        the adjoint A of the motion (Barfoot, State Estimation for Robotics, 7.3.1). A frame is
///        measured against the map, not against the frame before: P, c and the motion are those of
///        an anchor, the last pose that has moved off for certain or has changed the map. While the
///        rig stands nothing adds up.
///
///     const Mat6 motion = motion_covariance(fit, drift.motion_to(T_left_world), 0);
///     drift.step(T_left_world, motion, 0.005, keyframe);
///     use(drift.pose());
///
/// Threads  A value; one caller. Memory: none.
class DriftCovariance {
 public:
  /// The next pose, the covariance of the motion to it as motion_covariance()'s, and the relative
  /// 1 σ of its length by the calibration. `map_changed` by this frame: what follows is measured
  /// against something new. The first pose is exact: it is the world.
  void step(const Transform& T_left_world, const Mat6& motion, double length_sigma,
            bool map_changed) noexcept;
  /// T_now_before of a pose that follows; before the first the identity.
  [[nodiscard]] Transform motion_to(const Transform& T_left_world) const noexcept {
    return any_ ? T_left_world * now_.T_left_world.inverse() : Transform{};
  }
  /// Covariance of the pose T_world_left relative to the first one: left camera's position (m),
  /// then rotation (rad), both about the world's axes.
  [[nodiscard]] Mat6 pose() const noexcept;

 private:
  struct Pose {
    Transform T_left_world{};
    Mat6 noise = Mat6::Zero();  // of T_left_world: left perturbation, translation first
    // 1 σ effect on T_left_world of each shared error: lengths, then rotations about x, y, z.
    Eigen::Matrix<double, 6, 4> shared = Eigen::Matrix<double, 6, 4>::Zero();
  };
  bool any_ = false;
  Pose now_{}, anchor_{};
};

}  // namespace vergence::odometry
