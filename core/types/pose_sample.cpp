#include "core/types/pose_sample.hpp"

#include <cassert>

namespace vergence {
namespace {

template <std::size_t N, class Enum>
std::string_view name(const std::array<std::string_view, N>& names, Enum value) noexcept {
  const auto i = static_cast<std::size_t>(value);
  assert(i < N);
  return names[i];
}

}  // namespace

std::string_view to_string(State s) noexcept {
  static constexpr std::array<std::string_view, 6> names = {"initialising",  "parallel_monocular",
                                                            "calibrating",   "stereo_odometry",
                                                            "recalibrating", "lost"};
  return name(names, s);
}

std::string_view to_string(PoseStatus s) noexcept {
  static constexpr std::array<std::string_view, 3> names = {"ok", "degraded", "lost"};
  return name(names, s);
}

std::string_view to_string(Reason r) noexcept {
  static constexpr std::array<std::string_view, 23> names = {"",
                                                             "no_image",
                                                             "image_dark",
                                                             "image_repeated",
                                                             "few_features",
                                                             "no_stereo_matches",
                                                             "cameras_swapped",
                                                             "few_inliers",
                                                             "one_camera",
                                                             "no_pose",
                                                             "time_gap",
                                                             "scene_restarted",
                                                             "weak_geometry",
                                                             "moving_scene",
                                                             "unconfirmed",
                                                             "unverified_calibration",
                                                             "recalibrating",
                                                             "uncalibrated",
                                                             "out_of_step",
                                                             "needs_motion",
                                                             "needs_near_structure",
                                                             "needs_texture",
                                                             "unproven_pairing"};
  return name(names, r);
}

std::string_view to_string(Stage s) noexcept {
  static constexpr std::array<std::string_view, kStages> names = {"pyramid", "detect", "track",
                                                                  "match",   "pose",   "window"};
  return name(names, s);
}

}  // namespace vergence
