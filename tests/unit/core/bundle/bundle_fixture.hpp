#pragma once
#include <memory>

#include "app/simulation/rig_simulation.hpp"

namespace vergence {

/// An adjuster with an arena of its own.
struct OwnAdjuster {
  explicit OwnAdjuster(const BundleCapacities& c) : adjuster(c, arena) {}
  Arena arena;
  BundleAdjuster adjuster;
};

inline BundleOptions calibration_options() {
  BundleOptions o;
  o.configuration = BundleConfiguration::stereo_calibration;
  return o;
}

/// With covariances; intrinsics exact unless a test says otherwise.
inline BundleOptions with_covariance() {
  BundleOptions o = calibration_options();
  o.covariance = true;
  for (BundleIntrinsics& i : o.intrinsics) i.held_sigma = {};
  return o;
}

inline SimulationOptions tight(int points = SimulationOptions{}.points) {
  SimulationOptions s;
  s.generator = SimulationGenerator::tight;
  s.start_points = -1;
  s.points = points;
  return s;
}

/// The way from one transform to another as a left perturbation (φ, τ).
inline Vec6 way(const Transform& from, const Transform& to) {
  Vec6 e;
  e << log_so3(to.R * from.R.transpose()), to.t - from.t;
  return e;
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
