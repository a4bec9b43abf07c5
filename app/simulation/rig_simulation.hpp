#pragma once
#include <vector>

#include "core/bundle/bundle.hpp"
#include "core/math/random.hpp"

namespace vergence {

enum class SimulationGenerator : std::uint8_t {
  /// Rigs are 20 to 25 m from the cloud's centre. The left camera looks exactly at it, the right
  /// camera is on its x axis.
  ring,
  /// Rigs are as close as all points stay in view. The middle of the baseline looks at the centre;
  /// the baseline is slightly rotated.
  tight,
};
enum class SimulationShape : std::uint8_t { ball, shell };

/// Simulated rig of Warren et al. 2013, Sec. V-A: a cloud of points round the origin, snapshots of
/// a rig all round it, every point in every image.
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
  /// Uniform initial error per axis (±) of the centre of camera k in m; the true baseline length is
  /// then restored.
  double start_translation = 0.05;
  /// Uniform initial error per axis (±) of the points in m; negative: triangulated from the
  /// perturbed cameras.
  double start_points = 0.1;
};

/// Simulated problem: truth, measurements and start values. Allocates; not for the real-time path.
struct SimulatedRig {
  std::vector<Camera> cameras;
  /// True T_camera_left and T_left_world.
  std::vector<Transform> true_cameras, true_poses;
  /// Start values.
  std::vector<Transform> T_camera_left, T_left_world;
  std::vector<Vec3> true_points, points;
  std::vector<BundleObservation> observations;

  /// Problem with the start values in these arrays; the first pose is constant.
  [[nodiscard]] BundleProblem problem() noexcept;
};

/// Draws a problem. Throws std::runtime_error if no view of the whole cloud exists.
[[nodiscard]] SimulatedRig simulate_rig(const SimulationOptions& options, Random& random);

/// Capacities for such a problem.
[[nodiscard]] BundleCapacities capacities_for(const SimulationOptions& options);

}  // namespace vergence
