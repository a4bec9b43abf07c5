#pragma once
#include <array>
#include <cstdint>
#include <string_view>

#include "core/math/se3.hpp"
#include "core/types/frame_workload.hpp"
#include "core/types/time.hpp"

namespace vergence {

enum class State : std::uint8_t {
  initialising,
  parallel_monocular,
  calibrating,
  stereo_odometry,
  recalibrating,
  lost
};

enum class PoseStatus : std::uint8_t {
  /// The pose is reliable.
  ok,
  /// The pose is usable; `reason` names its weakness.
  degraded,
  /// There is no pose.
  lost,
};

/// Reason why a pose is not `ok`; its name is written to poses.csv.
enum class Reason : std::uint8_t {
  none,
  /// A camera delivered no image for this frame.
  no_image,
  /// An image has no structure: covered, black or saturated.
  image_no_contrast,
  /// A camera delivered its previous image again, now or recently, while others delivered new ones.
  /// It may be an exposure late until a dozen moving frames show otherwise.
  image_repeated,
  /// There is too little texture to start from.
  few_features,
  /// Left and right images do not fit this calibration.
  no_stereo_matches,
  /// Points would lie behind the rig: left and right are swapped.
  cameras_swapped,
  /// The pose is based on few points, or they fit it much worse than their noise.
  few_inliers,
  /// Only one camera supports the pose; its scale is that of earlier points.
  single_camera,
  /// Tracking failed.
  no_pose,
  /// No frame arrived for longer than motion can be predicted, up to ten frames ago.
  time_gap,
  /// The map was rebuilt; the motion across the gap was extrapolated.
  map_reset,
  /// The points constrain the pose poorly, or several times worse than usual in this frame or a
  /// recent one.
  weak_geometry,
  /// There are more outliers than in a rigid scene.
  dynamic_scene,
  /// The calibration in use is not verified.
  unverified_calibration,
  /// The rig does not fit its calibration now, or did not up to ten frames ago.
  recalibrating,
  /// There is no calibration yet: each camera's pose is estimated separately, with the scale of the
  /// assumed baseline.
  uncalibrated,
  /// A camera's images are from another instant than the others'.
  out_of_sync,
  /// The calibration cannot be estimated without motion.
  needs_motion,
  /// The calibration cannot be estimated without points near the rig.
  needs_near_structure,
  /// The calibration cannot be estimated without texture to match.
  needs_texture,
  /// The synchronisation contradicts that the images were exposed together; only one of them was
  /// used.
  pairing_ambiguous,
};

[[nodiscard]] std::string_view to_string(State) noexcept;
[[nodiscard]] std::string_view to_string(PoseStatus) noexcept;
[[nodiscard]] std::string_view to_string(Reason) noexcept;

/// Stages of one frame, in order; summary.json uses these names.
enum class Stage : std::uint8_t { pyramid, detect, track, match, pose, window };
inline constexpr int kStages = 6;
[[nodiscard]] std::string_view to_string(Stage) noexcept;

/// Upper triangle of a symmetric 6×6 matrix, row by row.
using Covariance6 = std::array<float, 21>;

/// Result of the estimator for one frame. A value: copied through rings.
struct PoseSample {
  std::uint64_t frame = 0;
  Stamp stamp{};
  State state = State::initialising;
  PoseStatus status = PoseStatus::lost;
  Reason reason = Reason::none;

  /// Pose of the left camera; the identity when `lost`.
  Transform T_world_left{};
  /// Covariance of T_world_left by dead reckoning since the first pose: position (m), then rotation
  /// (rad), about the world's axes.
  Covariance6 covariance{};
  /// Covariance of the motion since the last pose, without length_sigma: translation (m), then
  /// rotation (rad), about the left camera's axes.
  Covariance6 motion_covariance{};

  /// Relative standard deviation that all lengths share, from the calibration.
  float length_sigma = 0;

  /// Number of points that support the pose.
  int inliers = 0;
  /// Number of inliers seen by a second camera in this frame.
  int stereo_inliers = 0;
  /// Root mean square residual of the inliers, per coordinate.
  double reprojection_px = 0;
  bool keyframe = false;

  /// Work done in addition to the pose.
  FrameWorkload effort{};
  /// Wall time of each stage; of parallel ones the slower side.
  std::array<float, kStages> stage_ms{};
  /// Wall time from the images' arrival to this sample.
  float estimate_ms = 0;
};

}  // namespace vergence
