#pragma once
#include "core/bundle/bundle.hpp"
#include "core/odometry/map.hpp"
#include "core/odometry/options.hpp"
#include "core/types/frame_workload.hpp"

namespace vergence::odometry {

struct WindowOutcome {
  /// True if poses and points were written back.
  bool usable = false;
  int observations = 0;
  /// Number of observations that no longer fit.
  int dropped = 0;
  int steps = 0;
};

/// Adjusts the window's poses and points together; the oldest keyframe is constant.
///
/// A calibration error changes all disparities of a window equally. So the rotation of every
/// additional camera that shifts disparities is estimated with the window, with the sigma of the
/// calibration's depths as prior. Each window starts from the calibration, so that nothing counts
/// twice, and the estimate never leaves the odometry.
///
/// Ownership  Options, rig and runner are the caller's and outlive the object.
/// Threads    One caller; the runner takes half of the points. Results do not depend on its
/// threads. Memory     From the arena at construction. Observations beyond its capacity are left
/// out.
class WindowAdjuster {
 public:
  WindowAdjuster(const OdometryOptions& options, const RigCalibration& rig, Arena& arena,
                 PairRunner& runner);

  /// Adjusts the newest keyframes within the limits of `effort`. Writes poses and points back if
  /// the result is usable, and drops observations beyond the robust limit. T_camera_left() has the
  /// transforms.
  ///
  /// With unlinked cameras every image has its own pose, in Keyframe::T_camera_left. All images of
  /// the oldest keyframe are constant; the caller renews the scale.
  WindowOutcome adjust(Map& map, bool linked, const FrameWorkload& effort = {}) noexcept;
  /// Call when the owner's rig was changed to another calibration.
  void adopt_rig() noexcept;
  /// Transforms estimated by the last adjustment, one per camera.
  [[nodiscard]] const std::array<Transform, kMaxCameras>& T_camera_left() const noexcept {
    return T_camera_left_;
  }

 private:
  [[nodiscard]] static BundleCapacities capacities(const OdometryOptions& options,
                                                   const RigCalibration& rig) noexcept;
  /// Sets the prior of the additional cameras' rotations from the calibration's covariance.
  void set_rotation_prior() noexcept;
  void gather(Map& map, bool linked, const FrameWorkload& effort) noexcept;
  [[nodiscard]] WindowOutcome solve(bool linked, const FrameWorkload& effort) noexcept;
  [[nodiscard]] int drop_outliers(Map& map) noexcept;

  const OdometryOptions& options_;
  const RigCalibration& rig_;
  BundleAdjuster adjuster_;
  // The calibration, with the prior covariance of the rotations that are estimated.
  RigCalibration prior_rig_;
  bool rotations_free_ = false;
  std::array<Camera, kMaxCameras> cameras_{};
  std::array<Transform, kMaxCameras> T_camera_left_{};
  // Index of the oldest adjusted keyframe in the map's order.
  std::size_t oldest_ = 0;
  FixedVector<Transform, kMaxWindow * kMaxCameras> poses_;
  FixedVector<std::uint8_t, kMaxWindow * kMaxCameras> constant_;
  BoundedVector<Vec3> points_;
  BoundedVector<std::uint16_t> owner_;
  BoundedVector<BundleObservation> observations_;
  std::span<float> residuals_;
};

}  // namespace vergence::odometry
