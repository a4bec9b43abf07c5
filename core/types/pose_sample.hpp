#pragma once
#include <array>
#include <cstdint>
#include <string_view>

#include "core/math/se3.hpp"
#include "core/types/frame_workload.hpp"
#include "core/types/time.hpp"

namespace vergence {

/// State of the estimator.
enum class State : std::uint8_t {
  initialising,
  parallel_monocular,
  calibrating,
  stereo_odometry,
  recalibrating,
  lost
};

/// Status of a pose.
enum class PoseStatus : std::uint8_t {
  ok,        // use it
  degraded,  // usable, `reason` names what is weak
  lost,      // there is no pose: do not use
};

/// Why a pose is not `ok`. One word each: it stands in poses.csv.
enum class Reason : std::uint8_t {
  none,
  no_image,           // a camera delivered nothing for this frame
  image_no_contrast,  // an image carries no structure: covered, black, saturated
  image_repeated,     // a camera delivered the image of the frame before once more, now or earlier
                      // while others went on: it may be an exposure behind until a dozen frames of
                      // a rig that drives have shown it is not
  few_features,       // too little texture to start from
  no_stereo_matches,  // left and right do not fit this calibration
  cameras_swapped,    // points would lie behind the rig: left and right exchanged
  few_inliers,        // the pose rests on few points
  single_camera,      // only one camera supports the pose; its scale is remembered, not measured
  no_pose,            // tracking failed
  time_gap,           // no frame for longer than motion can be predicted, up to ten frames ago
  map_reset,          // the map was rebuilt; the motion across the gap was extrapolated
  weak_geometry,      // the points do not hold the pose well, or several times worse than usual,
                      // or the window moved the pose far
  dynamic_scene,      // more outliers than a rigid scene has
  unverified_calibration,  // the calibration in use is not verified yet, or no longer
  recalibrating,           // the rig no longer fits its calibration, up to ten frames ago
  uncalibrated,  // no calibration yet: each camera's pose is estimated separately, with the scale
                 // of the assumed baseline
  out_of_sync,   // a camera's images are of another instant than the others'
  needs_motion,  // the calibration has to be found and cannot be without driving
  needs_near_structure,  // the calibration cannot be found without points near the rig
  needs_texture,         // the calibration cannot be found without texture to match
  pairing_ambiguous,  // the synchronisation contradicts that its images were exposed together: only
                      // one of them was used
};

[[nodiscard]] std::string_view to_string(State) noexcept;
[[nodiscard]] std::string_view to_string(PoseStatus) noexcept;
[[nodiscard]] std::string_view to_string(Reason) noexcept;

/// Stages of one frame, in order; times of summary.json carry these names.
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
  Transform T_world_left{};  // identity and meaningless when `lost`
  Covariance6 covariance{};  // of T_world_left, by dead reckoning since the first pose: position
                             // (m), rotation (rad), about the world's axes
  Covariance6 motion_covariance{};  // of the motion since the last pose: translation (m), rotation
                                    // (rad), about the left camera's axes; without …
  float length_sigma = 0;  // … the relative error that all lengths share, 1 σ: the calibration's
  float corrected_m = 0;   // that the window moved the pose by after its fit; in the covariances
  int inliers = 0;         // points that support the pose
  int stereo_inliers = 0;  // of these, seen by a second camera in this frame
  double reprojection_px = 0;  // rms of the inliers' residuals, per coordinate
  bool keyframe = false;
  FrameWorkload effort{};                 // what was done of the work beside the pose
  std::array<float, kStages> stage_ms{};  // wall time; the parallel stages as the slower side took
  float estimate_ms = 0;                  // wall time from the images in hand to this sample
};

}  // namespace vergence
