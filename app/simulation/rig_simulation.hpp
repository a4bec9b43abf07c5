#pragma once
#include <cstdint>
#include <vector>

#include "core/bundle/bundle.hpp"
#include "core/math/random.hpp"

namespace vergence {

enum class SimulationGenerator : std::uint8_t {
  ring,  // rigs 20 … 25 m from the cloud's centre, left camera looking exactly at it, right camera
         // on its x axis
  tight,  // rigs as near as all points stay in view, the middle of the baseline looking at the
          // centre, baseline slightly askew
};
enum class SimulationShape : std::uint8_t { ball, shell };

/// The paper's simulated rig (Sec. V-A): a cloud of points round the origin, snapshots of a rig all
/// round it, every point in every image.
struct SimulationOptions {
  SimulationGenerator generator = SimulationGenerator::ring;
  SimulationShape shape = SimulationShape::ball;
  /// 1 to kMaxCameras.
  int cameras = 2;
  /// Rig poses; the first is known.
  int poses = 10;
  int points = 100;
  /// Radius of the point cloud, m.
  double radius = 7;
  /// Sigma of the Gaussian noise of each coordinate, px.
  double noise = 0.1;
  /// Uniform initial error per axis (±) of the rig centres but the first, m.
  double start_position = 0.1;
  /// Uniform initial error per axis (±) of the camera rotations, rad.
  double start_rotation = 0.1;
  double start_translation =
      0.05;  // m, uniform ±, an axis: centre of camera k, brought back to the true length
  double start_points =
      0.1;  // m, uniform ±, an axis; negative: triangulated from the perturbed cameras
};

/// One simulated problem: truth, measurements and a start. Plain memory of its own; not for the
/// real-time path.
struct SimulatedRig {
  std::vector<Camera> cameras;
  std::vector<Transform> true_cameras, true_poses;     // T_camera_left, T_left_world of the truth
  std::vector<Transform> T_camera_left, T_left_world;  // of the start
  std::vector<Vec3> true_points, points;
  std::vector<BundleObservation> observations;

  /// The start as a problem in these arrays; the first pose constant.
  [[nodiscard]] BundleProblem problem() noexcept;
  /// Variant like parallel_monocular: a pose an image, image = pose · cameras + camera; `images`
  /// keeps the poses.
  [[nodiscard]] BundleProblem monocular_problem(std::vector<Transform>* images,
                                                std::vector<BundleObservation>* per_image,
                                                std::vector<std::uint8_t>* constant);
};

/// Draws a problem. Throws std::runtime_error if no view of the whole cloud is found (impossible
/// options).
[[nodiscard]] SimulatedRig simulate_rig(const SimulationOptions& options, Random& random);

/// Moves the start (not the truth) as the options say; called by simulate_rig.
void perturb_start(SimulatedRig& rig, const SimulationOptions& options, Random& random);

/// Capacities that hold such a problem.
[[nodiscard]] BundleCapacities capacities_for(const SimulationOptions& options);

}  // namespace vergence
