#pragma once
#include "core/bundle/bundle.hpp"
#include "core/odometry/map.hpp"
#include "core/odometry/options.hpp"
#include "core/types/frame_workload.hpp"

namespace vergence::odometry {

struct WindowOutcome {
  bool usable = false;  // poses and points were written back
  BundleTermination termination = BundleTermination::invalid_input;
  int points = 0;
  int observations = 0;
  int dropped = 0;  // observations that no longer fit
  int steps = 0;
  double rms_px = 0;
};

/// Adjusts the window's poses and points together (stereo odometry): the oldest keyframe
/// is constant.
///
/// A calibration error moves all depths of a window together, by one disparity common to all
/// points, rather than by independent errors. So the turn of every further camera that shifts
/// disparities is estimated with the window, about the calibration's own, by the sigma that the
/// calibration's depths have (a consider parameter that the window may answer). It is found afresh
/// in each window, so that nothing is counted twice, and it never leaves the odometry.
///
/// Memory  From the arena at construction. More observations than fit: the rest are left out of
///         this adjustment.
class WindowAdjuster {
 public:
  WindowAdjuster(const OdometryOptions& options, const RigCalibration& rig, Arena& arena);
  [[nodiscard]] static std::size_t memory_needed(const OdometryOptions& options,
                                                 const RigCalibration& rig) noexcept;

  /// Writes poses and points back if the result is usable, and drops observations beyond the robust
  /// limit. T_camera_left() is what it found.
  /// Not more than `effort` allows: the newest keyframes, so many steps.
  WindowOutcome adjust(Map& map, const FrameWorkload& effort = {}) noexcept;
  /// As adjust(), with unlinked cameras: every image has a pose of its own, in
  /// Keyframe::T_camera_left (parallel monocular). Both images of the oldest keyframe
  /// are constant; the caller renews the scale.
  WindowOutcome adjust_unlinked(Map& map, const FrameWorkload& effort = {}) noexcept;
  /// Call when the owner's rig was changed to another calibration.
  void adopt_rig() noexcept;
  /// Transforms estimated by the last adjustment, one per camera.
  [[nodiscard]] std::span<const Transform> T_camera_left() const noexcept {
    return std::span(T_camera_left_).first(static_cast<std::size_t>(rig_.cameras));
  }

 private:
  [[nodiscard]] static BundleCapacities capacities(const OdometryOptions& options,
                                                   const RigCalibration& rig) noexcept;
  /// Sets the prior of the further cameras' rotations from the calibration's covariance.
  void set_rotation_prior() noexcept;
  void gather(Map& map, bool linked, const FrameWorkload& effort) noexcept;
  [[nodiscard]] WindowOutcome solve(BundleConfiguration configuration,
                                    const FrameWorkload& effort) noexcept;
  [[nodiscard]] int drop_outliers(Map& map) noexcept;

  const OdometryOptions& options_;
  const RigCalibration& rig_;
  BundleAdjuster adjuster_;
  RigCalibration prior_rig_;     // the calibration as it was given; `covariance`: of the turns that
                                 // are estimated with a window
  bool rotations_free_ = false;  // they are
  std::array<Camera, kMaxCameras> cameras_{};
  std::array<Transform, kMaxCameras> T_camera_left_{};
  std::size_t oldest_ = 0;  // in the map's order, of the keyframes that are adjusted
  FixedVector<Transform, kMaxWindow * kMaxCameras> poses_;
  FixedVector<std::uint8_t, kMaxWindow * kMaxCameras> constant_;
  BoundedVector<Vec3> points_;
  BoundedVector<std::uint16_t> owner_;  // index in the map of each point
  BoundedVector<BundleObservation> observations_;
  std::span<float> residuals_;
};

}  // namespace vergence::odometry
