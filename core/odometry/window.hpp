#pragma once
#include "core/bundle/bundle.hpp"
#include "core/odometry/map.hpp"
#include "core/odometry/options.hpp"

namespace vergence::odometry {

struct WindowOutcome {
  bool usable = false;  // poses and points were written back
  BundleTermination termination = BundleTermination::invalid_input;
  int points = 0;
  int observations = 0;
  int dropped = 0;  // sightings that no longer fit
  int steps = 0;
  double rms_px = 0;
};

/// Adjusts the window's poses and points together (METHOD §2, stereo odometry): the oldest keyframe is constant.
///
/// Memory  From the arena at construction. More sightings than fit: the rest are left out of this adjustment.
class WindowAdjuster {
 public:
  WindowAdjuster(const OdometryOptions& options, const RigCalibration& rig, Arena& arena);
  [[nodiscard]] static std::size_t memory_needed(const OdometryOptions& options, const RigCalibration& rig) noexcept;

  /// Writes poses and points back if the result is usable, and drops sightings beyond the robust limit.
  WindowOutcome adjust(Map& map) noexcept;
  /// The same with the cameras not linked: every image has a pose of its own, in Keyframe::T_camera_left (METHOD §2, parallel
  /// monocular). Both images of the oldest keyframe are constant; the caller renews the scale.
  WindowOutcome adjust_unlinked(Map& map) noexcept;
  /// The owner's rig has other intrinsics than before.
  void rebuild_cameras() noexcept;

 private:
  [[nodiscard]] static BundleCapacities capacities(const OdometryOptions& options, const RigCalibration& rig) noexcept;
  void gather(Map& map, bool linked) noexcept;
  [[nodiscard]] WindowOutcome solve(BundleConfiguration configuration) noexcept;
  [[nodiscard]] int drop_outliers(Map& map) noexcept;

  const OdometryOptions& options_;
  const RigCalibration& rig_;
  BundleAdjuster adjuster_;
  std::array<Camera, kMaxCameras> cameras_{};
  std::array<Transform, kMaxCameras> T_camera_left_{};
  FixedVector<Transform, kMaxWindow * kMaxCameras> poses_;
  FixedVector<std::uint8_t, kMaxWindow * kMaxCameras> constant_;
  BoundedVector<Vec3> points_;
  BoundedVector<std::uint16_t> owner_;  // index in the map of each point
  BoundedVector<BundleObservation> observations_;
  std::span<float> residuals_;
};

}  // namespace vergence::odometry
