#include "app/simulation/rig_simulation.hpp"

#include <cmath>
#include <stdexcept>

#include <Eigen/Cholesky>

namespace vergence {
namespace {

// Image size in px.
constexpr int kWidth = 1024, kHeight = 768;
// Half field of view in rad, 60° across.
constexpr double kHalfField = M_PI / 6;
// Maximum number of views drawn before the options count as impossible.
constexpr int kMaxTries = 1000;

Camera pinhole() {
  Intrinsics k{.width = kWidth, .height = kHeight};
  k.fx = k.fy = 0.5 * kWidth / std::tan(kHalfField);
  k.cx = 0.5 * (kWidth - 1);
  k.cy = 0.5 * (kHeight - 1);
  return Camera(k);
}

Vec3 direction(Random& random) {
  // The loop ends, because each draw succeeds with probability 1 except for the null vector.
  for (;;) {
    const Vec3 v(random.normal(), random.normal(), random.normal());
    if (v.norm() > 1e-6) return v.normalized();
  }
}

Vec3 box(Random& random, double half) {
  const double x = random.uniform(-half, half), y = random.uniform(-half, half),
               z = random.uniform(-half, half);
  return {x, y, z};
}

/// Rows x, y, z of a camera that looks along `axis`, rolled by `roll`.
Mat3 looking_along(const Vec3& axis, double roll) {
  const Vec3 side =
      (std::abs(axis.z()) < 0.9 ? Vec3::UnitZ() : Vec3::UnitX()).cross(axis).normalized();
  Mat3 R;
  R.row(0) = side;
  R.row(1) = axis.cross(side);
  R.row(2) = axis;
  return exp_so3({0, 0, roll}) * R;
}

std::vector<Transform> draw_cameras(const SimulationOptions& o, Random& random) {
  std::vector<Transform> cameras(1);
  for (int k = 1; k < o.cameras; ++k) {
    const double baseline = random.uniform(0.5, 1.0);
    const Vec3 along = k == 1 ? Vec3::UnitX() : k == 2 ? Vec3::UnitY() : Vec3(1, 1, 0).normalized();
    if (o.generator == SimulationGenerator::ring) {
      const Mat3 R = exp_so3(direction(random) * random.uniform(0, 0.02));
      cameras.push_back({R, -(R * (baseline * along))});
    } else {
      const Vec3 t = (-along + (Mat3::Identity() - along * along.transpose()) * box(random, 0.05))
                         .normalized() *
                     baseline;
      cameras.push_back({exp_so3(box(random, 0.05)), t});
    }
  }
  return cameras;
}

bool sees_all(const SimulatedRig& rig, const Transform& T_left_world) {
  for (std::size_t k = 0; k < rig.cameras.size(); ++k) {
    const Transform T = rig.true_cameras[k] * T_left_world;
    for (const Vec3& p : rig.true_points) {
      Vec2 pixel;
      if (rig.cameras[k].project(T * p, &pixel, nullptr) != ProjectStatus::ok ||
          !rig.cameras[k].inside(pixel, 0))
        return false;
    }
  }
  return true;
}

Transform draw_pose(const SimulatedRig& rig, const SimulationOptions& o, Random& random) {
  for (int attempt = 0; attempt < kMaxTries; ++attempt) {
    const Vec3 outward = direction(random);
    const Mat3 R = looking_along(-outward, random.uniform(0, 2 * M_PI));
    if (o.generator == SimulationGenerator::ring) {
      const Vec3 centre = outward * random.uniform(20, 25);
      Transform T{R, -(R * centre)};
      if (sees_all(rig, T)) return T;
      continue;
    }
    // Left camera so that the middle of the baseline to camera 1 sits on the axis through the
    // centre.
    const Vec3 middle =
        rig.true_cameras.size() > 1 ? Vec3(0.5 * rig.true_cameras[1].centre()) : Vec3::Zero();
    double distance = 1.02 * o.radius;
    for (int step = 0; step < 400; ++step, distance *= 1.02) {
      const Vec3 centre = outward * distance - R.transpose() * middle;
      Transform T{R, -(R * centre)};
      if (sees_all(rig, T)) return T;
    }
  }
  throw std::runtime_error("simulation: no pose has the whole cloud in view; lower --radius");
}

/// The point nearest to all rays of a track, least squares, from the start's cameras.
Vec3 triangulate(const SimulatedRig& rig, const BundleObservation* first,
                 const BundleObservation* last) {
  Mat3 A = Mat3::Zero();
  Vec3 b = Vec3::Zero();
  for (const BundleObservation* o = first; o != last; ++o) {
    const Transform T = rig.T_camera_left[o->camera] * rig.T_left_world[o->pose];
    Vec3 ray;
    if (!rig.cameras[o->camera].unproject({o->x, o->y}, &ray)) continue;
    const Vec3 d = (T.R.transpose() * ray).normalized();
    const Mat3 stereo = Mat3::Identity() - d * d.transpose();
    A += stereo;
    b += stereo * T.centre();
  }
  return A.ldlt().solve(b);
}

/// Perturbs the start values by the options.
void perturb_start(SimulatedRig& rig, const SimulationOptions& o, Random& random) {
  rig.T_camera_left = rig.true_cameras;
  rig.T_left_world = rig.true_poses;
  rig.points = rig.true_points;
  for (std::size_t i = 1; i < rig.T_left_world.size(); ++i) {
    Transform& T = rig.T_left_world[i];
    T.t = -(T.R * (T.centre() + box(random, o.start_position)));
  }
  for (std::size_t k = 1; k < rig.T_camera_left.size(); ++k) {
    Transform& T = rig.T_camera_left[k];
    const double length = T.t.norm();
    const Vec3 centre = T.centre() + box(random, o.start_translation);
    T.R = exp_so3(box(random, o.start_rotation)) * T.R;
    T.t = -(T.R * centre.normalized()) * length;
  }
  if (o.start_points >= 0) {
    for (Vec3& p : rig.points) p += box(random, o.start_points);
    return;
  }
  for (std::size_t first = 0; first < rig.observations.size();) {
    std::size_t last = first;
    while (last < rig.observations.size() &&
           rig.observations[last].point == rig.observations[first].point)
      ++last;
    rig.points[rig.observations[first].point] =
        triangulate(rig, rig.observations.data() + first, rig.observations.data() + last);
    first = last;
  }
}

}  // namespace

BundleProblem SimulatedRig::problem() noexcept {
  BundleProblem p;
  p.cameras = cameras;
  p.T_camera_left = T_camera_left;
  p.T_left_world = T_left_world;
  p.points = points;
  p.observations = observations;
  return p;
}

SimulatedRig simulate_rig(const SimulationOptions& o, Random& random) {
  SimulatedRig rig;
  rig.cameras.assign(static_cast<std::size_t>(o.cameras), pinhole());
  rig.true_cameras = draw_cameras(o, random);
  for (int i = 0; i < o.points; ++i) {
    const Vec3 d = direction(random);
    const double r = o.shape == SimulationShape::shell ? 1.0 : std::cbrt(random.uniform());
    rig.true_points.push_back(d * r * o.radius);
  }
  for (int i = 0; i < o.poses; ++i) rig.true_poses.push_back(draw_pose(rig, o, random));
  for (std::uint32_t j = 0; j < rig.true_points.size(); ++j)
    for (std::size_t i = 0; i < rig.true_poses.size(); ++i)
      for (std::size_t k = 0; k < rig.cameras.size(); ++k) {
        Vec2 pixel;
        if (rig.cameras[k].project(rig.true_cameras[k] * (rig.true_poses[i] * rig.true_points[j]),
                                   &pixel, nullptr) != ProjectStatus::ok)
          continue;
        const double dx = random.normal(), dy = random.normal();
        const float inverse_sigma = o.noise > 0 ? static_cast<float>(1.0 / o.noise) : 1.0F;
        rig.observations.push_back({j, static_cast<std::uint16_t>(i), static_cast<std::uint8_t>(k),
                                    inverse_sigma, pixel.x() + o.noise * dx,
                                    pixel.y() + o.noise * dy});
      }
  perturb_start(rig, o, random);
  return rig;
}

BundleCapacities capacities_for(const SimulationOptions& o) {
  const auto cameras = static_cast<std::size_t>(o.cameras),
             poses = static_cast<std::size_t>(o.poses) * cameras,
             points = static_cast<std::size_t>(o.points);
  // The count of poses equals that of parallel_monocular.
  return {.cameras = cameras, .poses = poses, .points = points, .observations = poses * points};
}

}  // namespace vergence
