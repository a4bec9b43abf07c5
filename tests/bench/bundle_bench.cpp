// The partitioned bundle adjustment against Ceres on the simulated rig: the same random problems,
// in alternation, one thread.
// Usage: bundle_bench [runs]. One line a size: medians of the solve alone, their ratio, the largest
// relative difference between our final cost and that of Ceres run on, untimed, until nothing
// changes.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include <ceres/ceres.h>
#include <glog/logging.h>

#include "app/simulation/rig_simulation.hpp"

namespace vergence {
namespace {

/// A transform as qx qy qz qw tx ty tz, moved by R ← Exp(φ) R, t ← t + τ; `sphere`: t keeps its
/// length and has two directions. Cost functions give derivatives by (φ, τ) in the first six
/// ambient columns, so that the manifold's part of the chain is a selection.
class TransformManifold final : public ceres::Manifold {
 public:
  explicit TransformManifold(bool sphere) : sphere_(sphere) {}
  int AmbientSize() const override { return 7; }
  int TangentSize() const override { return sphere_ ? 5 : 6; }
  bool Plus(const double* x, const double* delta, double* out) const override {
    const Eigen::Map<const Eigen::Quaterniond> q(x);
    const Eigen::Map<const Vec3> t(x + 4);
    Eigen::Map<Eigen::Quaterniond> moved(out);
    moved = (Eigen::Quaterniond(exp_so3(Eigen::Map<const Vec3>(delta))) * q).normalized();
    if (!sphere_) {
      Eigen::Map<Vec3>(out + 4) = t + Eigen::Map<const Vec3>(delta + 3);
      return true;
    }
    const auto [a, b] = basis(t);
    Eigen::Map<Vec3>(out + 4) = (t + delta[3] * a + delta[4] * b).normalized() * t.norm();
    return true;
  }
  bool PlusJacobian(const double* x, double* jacobian) const override {
    if (!sphere_) {
      Eigen::Map<Eigen::Matrix<double, 7, 6, Eigen::RowMajor>> J(jacobian);
      J.setZero();
      J.topLeftCorner<6, 6>().setIdentity();
      return true;
    }
    Eigen::Map<Eigen::Matrix<double, 7, 5, Eigen::RowMajor>> J(jacobian);
    J.setZero();
    J.topLeftCorner<3, 3>().setIdentity();
    const auto [a, b] = basis(Eigen::Map<const Vec3>(x + 4));
    J.block<3, 1>(3, 3) = a;
    J.block<3, 1>(3, 4) = b;
    return true;
  }
  bool Minus(const double*, const double*, double*) const override {
    return false;
  }  // not used by the solver
  bool MinusJacobian(const double*, double*) const override { return false; }

 private:
  static std::pair<Vec3, Vec3> basis(const Vec3& t) {
    const Vec3 u = t.normalized(), a = u.unitOrthogonal();
    return {a, u.cross(a)};
  }
  bool sphere_;
};

struct Pinhole {
  double fx, fy, cx, cy;
};

using Mat37 = Eigen::Map<Eigen::Matrix<double, 2, 7, Eigen::RowMajor>>;
using Mat33 = Eigen::Map<Eigen::Matrix<double, 2, 3, Eigen::RowMajor>>;

/// Residual and G (2×3, weighted) of a point in the camera.
inline bool residual_of(const Pinhole& k, const BundleObservation& o, const Vec3& p,
                        double* residual, Mat23* G) {
  if (!(p.z() > kMinDepth)) return false;
  const double s = o.inverse_sigma, iz = 1 / p.z(), x = p.x() * iz, y = p.y() * iz;
  residual[0] = s * (k.fx * x + k.cx - o.x);
  residual[1] = s * (k.fy * y + k.cy - o.y);
  *G << s * k.fx * iz, 0, -s * k.fx * iz * x, 0, s * k.fy * iz, -s * k.fy * iz * y;
  return true;
}

inline void put_pose(const Mat23& F, const Vec3& turned, double* jacobian) {
  Mat37 J(jacobian);
  J.leftCols<3>().noalias() = -F * skew(turned);
  J.middleCols<3>(3) = F;
  J.col(6).setZero();
}

class LeftCost final : public ceres::SizedCostFunction<2, 7, 3> {
 public:
  LeftCost(const Pinhole& k, const BundleObservation& o) : k_(k), o_(o) {}
  bool Evaluate(double const* const* v, double* residual, double** jacobians) const override {
    const Mat3 R = Eigen::Map<const Eigen::Quaterniond>(v[0]).toRotationMatrix();
    const Vec3 turned = R * Eigen::Map<const Vec3>(v[1]);
    Mat23 G;
    if (!residual_of(k_, o_, turned + Eigen::Map<const Vec3>(v[0] + 4), residual, &G)) return false;
    if (jacobians == nullptr) return true;
    if (jacobians[0] != nullptr) put_pose(G, turned, jacobians[0]);
    if (jacobians[1] != nullptr) Mat33(jacobians[1]).noalias() = G * R;
    return true;
  }

 private:
  Pinhole k_;
  BundleObservation o_;
};

class RightCost final : public ceres::SizedCostFunction<2, 7, 7, 3> {
 public:
  RightCost(const Pinhole& k, const BundleObservation& o) : k_(k), o_(o) {}
  bool Evaluate(double const* const* v, double* residual, double** jacobians) const override {
    const Mat3 Rk = Eigen::Map<const Eigen::Quaterniond>(v[0]).toRotationMatrix(),
               R = Eigen::Map<const Eigen::Quaterniond>(v[1]).toRotationMatrix();
    const Vec3 turned = R * Eigen::Map<const Vec3>(v[2]);
    const Vec3 rig_turned = Rk * (turned + Eigen::Map<const Vec3>(v[1] + 4));
    Mat23 G;
    if (!residual_of(k_, o_, rig_turned + Eigen::Map<const Vec3>(v[0] + 4), residual, &G))
      return false;
    if (jacobians == nullptr) return true;
    const Mat23 F = G * Rk;
    if (jacobians[0] != nullptr) put_pose(G, rig_turned, jacobians[0]);
    if (jacobians[1] != nullptr) put_pose(F, turned, jacobians[1]);
    if (jacobians[2] != nullptr) Mat33(jacobians[2]).noalias() = F * R;
    return true;
  }

 private:
  Pinhole k_;
  BundleObservation o_;
};

void put(const Transform& T, double out[7]) {
  Eigen::Map<Eigen::Quaterniond> q(out);
  q = Eigen::Quaterniond(T.R);
  Eigen::Map<Vec3>(out + 4) = T.t;
}

double milliseconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
      .count();
}

struct CeresRun {
  double ms = 0, cost = 0;
  int steps = 0;
};

CeresRun solve_with_ceres(const SimulatedRig& rig) {
  std::vector<std::array<double, 7>> poses(rig.T_left_world.size());
  std::array<double, 7> right{};
  for (std::size_t i = 0; i < poses.size(); ++i) put(rig.T_left_world[i], poses[i].data());
  put(rig.T_camera_left[1], right.data());
  std::vector<Vec3> points = rig.points;
  const Intrinsics& in = rig.cameras[0].intrinsics();
  const Pinhole k{in.fx, in.fy, in.cx, in.cy};

  ceres::Problem problem;
  auto ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  for (const BundleObservation& o : rig.observations) {
    double* point = points[o.point].data();
    if (o.camera == 0)
      problem.AddResidualBlock(new LeftCost(k, o), nullptr, poses[o.pose].data(), point);
    else
      problem.AddResidualBlock(new RightCost(k, o), nullptr, right.data(), poses[o.pose].data(),
                               point);
  }
  for (Vec3& p : points) ordering->AddElementToGroup(p.data(), 0);
  for (auto& pose : poses) {
    problem.SetManifold(pose.data(), new TransformManifold(false));
    ordering->AddElementToGroup(pose.data(), 1);
  }
  problem.SetManifold(right.data(), new TransformManifold(true));
  ordering->AddElementToGroup(right.data(), 1);
  problem.SetParameterBlockConstant(poses[0].data());

  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_SCHUR;
  options.linear_solver_ordering = ordering;
  options.num_threads = 1;
  options.max_num_iterations = 30;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  const auto start = std::chrono::steady_clock::now();
  ceres::Solve(options, &problem, &summary);
  CeresRun run{milliseconds_since(start), 0, summary.num_successful_steps - 1};
  options.function_tolerance = options.parameter_tolerance =
      1e-14;  // to the very optimum: what the costs are compared with
  ceres::Solve(options, &problem, &summary);
  run.cost = summary.final_cost;
  return run;
}

double median(std::vector<double> v) {
  std::nth_element(v.begin(), v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2), v.end());
  return v[v.size() / 2];
}

void compare(int points, double noise, int runs) {
  SimulationOptions s;
  s.points = points;
  s.noise = noise;
  Arena arena(BundleAdjuster::memory_needed(capacities_for(s)));
  BundleAdjuster adjuster(capacities_for(s), arena);
  BundleOptions options;
  options.configuration = BundleConfiguration::stereo_calibration;
  Random random(1);
  std::vector<double> ours, theirs;
  double difference = 0, our_steps = 0, their_steps = 0;
  int failed = 0;
  for (int i = 0; i < runs; ++i) {
    SimulatedRig rig = simulate_rig(s, random);
    const CeresRun ceres = solve_with_ceres(rig);
    const BundleProblem problem = rig.problem();
    const auto start = std::chrono::steady_clock::now();
    const BundleResult r = adjuster.solve(problem, options);
    ours.push_back(milliseconds_since(start));
    theirs.push_back(ceres.ms);
    if (noise > 0)
      difference = std::max(difference, std::abs(r.final_cost - ceres.cost) / ceres.cost);
    our_steps += static_cast<double>(r.steps) / runs;
    their_steps += static_cast<double>(ceres.steps) / runs;
    failed += r.converged() ? 0 : 1;
  }
  std::printf(
      "points=%d noise=%.1f ours_ms=%.3f ceres_ms=%.3f ratio=%.1f cost_difference=%.1e "
      "ours_steps=%.1f ceres_steps=%.1f ours_min_ms=%.3f "
      "ceres_min_ms=%.3f failed=%d\n",
      points, noise, median(ours), median(theirs), median(theirs) / median(ours), difference,
      our_steps, their_steps, *std::min_element(ours.begin(), ours.end()),
      *std::min_element(theirs.begin(), theirs.end()), failed);
  std::fflush(stdout);
}

/// A window as the odometry has it: rig frames on a path, points alive for a few of them, Huber,
/// five steps.
void window(int runs) {
  constexpr int kPoses = 11, kPoints = 300;
  SimulationOptions s;
  s.poses = kPoses;
  s.points = kPoints;
  s.noise = 0.3;
  s.start_position = 0.02;
  s.start_points = 0.05;
  BundleCapacities c = capacities_for(s);
  c.shared = false;
  Arena arena(BundleAdjuster::memory_needed(c));
  BundleAdjuster adjuster(c, arena);
  BundleOptions options;
  options.loss = BundleLoss::huber;
  options.max_steps = 5;
  Random random(2);
  std::vector<double> ms;
  double steps = 0, observations = 0;
  for (int i = 0; i < runs; ++i) {
    SimulatedRig rig = simulate_rig(s, random);
    rig.T_camera_left = rig.true_cameras;
    std::vector<std::uint16_t> first(kPoints), last(kPoints);
    for (std::size_t j = 0; j < kPoints; ++j) {
      first[j] = static_cast<std::uint16_t>(random.below(kPoses - 1));
      last[j] = static_cast<std::uint16_t>(first[j] + 2 + random.below(5));
    }
    std::erase_if(rig.observations, [&](const BundleObservation& o) {
      return o.pose < first[o.point] || o.pose >= last[o.point];
    });
    observations += static_cast<double>(rig.observations.size()) / runs;
    const BundleProblem p = rig.problem();
    const auto start = std::chrono::steady_clock::now();
    const BundleResult r = adjuster.solve(p, options);
    ms.push_back(milliseconds_since(start));
    steps += static_cast<double>(r.steps) / runs;
  }
  std::printf(
      "window poses=%d points=%d observations=%.0f steps=%.1f ours_ms=%.3f ours_min_ms=%.3f\n",
      kPoses, kPoints, observations, steps, median(ms), *std::min_element(ms.begin(), ms.end()));
}

}  // namespace
}  // namespace vergence

int main(int argc, char** argv) {
  google::InitGoogleLogging(argv[0]);
  const int runs = argc > 1 ? std::atoi(argv[1]) : 40;
  if (runs < 1) {
    std::fprintf(stderr, "bundle_bench: the number of runs is not above 0\n");
    return 2;
  }
  vergence::compare(100, 0.1, runs);
  vergence::compare(1000, 0.1, runs);
  vergence::compare(1000, 0.3, runs);
  vergence::compare(100, 0.0, runs);
  vergence::window(runs);
  return 0;
}
