#pragma once
#include <memory>

#include "app/simulation/rig_simulation.hpp"

namespace vergence {

/// An adjuster with an arena of its own.
struct OwnAdjuster {
  explicit OwnAdjuster(const BundleCapacities& c)
      : arena(BundleAdjuster::memory_needed(c)), adjuster(c, arena) {}
  Arena arena;
  BundleAdjuster adjuster;
};

inline BundleOptions calibration_options() {
  BundleOptions o;
  o.configuration = BundleConfiguration::stereo_calibration;
  return o;
}

/// Largest distance between the free rigs' centres and the truth, m.
inline double pose_error(const SimulatedRig& rig) {
  double worst = 0;
  for (std::size_t i = 0; i < rig.T_left_world.size(); ++i)
    worst = std::max(worst, (rig.T_left_world[i].centre() - rig.true_poses[i].centre()).norm());
  return worst;
}

inline double rotation_error(const SimulatedRig& rig, std::size_t camera) {
  return rotation_angle(rig.T_camera_left[camera].R * rig.true_cameras[camera].R.transpose());
}

inline double translation_error(const SimulatedRig& rig, std::size_t camera) {
  return (rig.T_camera_left[camera].t - rig.true_cameras[camera].t).norm();
}

}  // namespace vergence
