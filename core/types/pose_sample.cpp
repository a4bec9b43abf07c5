#include "core/types/pose_sample.hpp"

#include "core/types/names.hpp"

namespace vergence {

std::string_view to_string(State s) noexcept {
  return name_of(s, std::array{"initialising", "parallel_monocular", "calibrating",
                               "stereo_odometry", "recalibrating", "lost"});
}

std::string_view to_string(PoseStatus s) noexcept {
  return name_of(s, std::array{"ok", "degraded", "lost"});
}

std::string_view to_string(Reason r) noexcept {
  return name_of(r, std::array{"",
                               "no_image",
                               "image_no_contrast",
                               "image_repeated",
                               "few_features",
                               "no_stereo_matches",
                               "cameras_swapped",
                               "few_inliers",
                               "single_camera",
                               "no_pose",
                               "time_gap",
                               "map_reset",
                               "weak_geometry",
                               "dynamic_scene",
                               "unverified_calibration",
                               "recalibrating",
                               "uncalibrated",
                               "out_of_sync",
                               "needs_motion",
                               "needs_near_structure",
                               "needs_texture",
                               "pairing_ambiguous"});
}

std::string_view to_string(Stage s) noexcept {
  return name_of(s, std::array{"pyramid", "detect", "track", "match", "pose", "window"});
}

}  // namespace vergence
