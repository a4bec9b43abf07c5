#pragma once

#include "app/simulation/rig_simulation.hpp"
#include "core/types/parallel.hpp"

namespace vergence {

/// An adjuster with an arena of its own.
struct OwnAdjuster {
  explicit OwnAdjuster(const BundleCapacities& c, PairRunner* runner = nullptr)
      : adjuster(c, arena, runner) {}
  Arena arena;
  BundleAdjuster adjuster;
};

/// A simulated rig and an adjuster with room for it.
struct Simulated {
  explicit Simulated(std::uint64_t seed, const SimulationOptions& s = {})
      : own(capacities_for(s)), random(seed), rig(simulate_rig(s, random)) {}
  OwnAdjuster own;
  Random random;
  SimulatedRig rig;
};

inline BundleOptions calibration_options() {
  return {.configuration = BundleConfiguration::stereo_calibration};
}

/// With covariances; intrinsics exact unless a test says otherwise.
inline BundleOptions with_covariance() {
  BundleOptions o = calibration_options();
  o.covariance = true;
  for (BundleIntrinsics& i : o.intrinsics) i.held_sigma = {};
  return o;
}

inline SimulationOptions tight(int points = SimulationOptions{}.points) {
  SimulationOptions s{
      .generator = SimulationGenerator::tight, .points = points, .start_points = -1};
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

/// Variant like parallel_monocular with a pose per image: image = pose · cameras + camera. `images`
/// receives the poses; the first one is constant.
inline BundleProblem monocular_problem(SimulatedRig* rig, std::vector<Transform>* images,
                                       std::vector<BundleObservation>* per_image,
                                       std::vector<std::uint8_t>* constant) {
  images->clear();
  for (const Transform& T : rig->T_left_world)
    for (const Transform& camera : rig->T_camera_left) images->push_back(camera * T);
  *per_image = rig->observations;
  for (BundleObservation& o : *per_image)
    o.pose = static_cast<std::uint16_t>(o.pose * rig->cameras.size() + o.camera);
  constant->assign(images->size(), 0);
  (*constant)[0] = 1;
  BundleProblem p = rig->problem();
  p.T_left_world = *images;
  p.observations = *per_image;
  p.pose_constant = *constant;
  p.T_camera_left = {};
  return p;
}

}  // namespace vergence
