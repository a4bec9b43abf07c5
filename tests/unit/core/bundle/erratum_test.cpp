// METHOD §1: with world → camera poses the rig is T_k P_i. In the order the paper prints, P_i T_k,
// camera k does not sit still on the rig.
#include <functional>

#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "tests/unit/core/bundle/bundle_fixture.hpp"

namespace vergence {
namespace {

using Vector = Eigen::VectorXd;

/// The printed model's cameras and points from one vector: T_1 (6), poses 1 … n (6 each), points (3
/// each); rotation vectors.
Vector printed_residuals(const SimulatedRig& rig, const Vector& v) {
  const auto transform_at = [&](Eigen::Index i) {
    return Transform{exp_so3(v.segment<3>(i)), v.segment<3>(i + 3)};
  };
  const Transform T1 = transform_at(0);
  const auto poses = static_cast<Eigen::Index>(rig.T_left_world.size());
  Vector e(2 * static_cast<Eigen::Index>(rig.observations.size()));
  for (std::size_t n = 0; n < rig.observations.size(); ++n) {
    const BundleObservation& o = rig.observations[n];
    const Transform P = o.pose == 0 ? rig.true_poses[0] : transform_at(6 * o.pose);
    const Vec3 X = v.segment<3>(6 * poses + 3 * static_cast<Eigen::Index>(o.point));
    const Vec3 Y = o.camera == 0 ? P * X : P * (T1 * X);
    const Intrinsics& k = rig.cameras[0].intrinsics();
    const double z =
        std::max(Y.z(), 0.1);  // a step that goes behind the camera is a bad step, not the end
    e.segment<2>(2 * static_cast<Eigen::Index>(n)) << k.fx * Y.x() / z + k.cx - o.x,
        k.fy * Y.y() / z + k.cy - o.y;
  }
  return e;
}

/// Levenberg–Marquardt with central differences: slow, general, and it shares no line with the
/// adjuster.
double fit(const std::function<Vector(const Vector&)>& residuals, Vector x) {
  double lambda = 1e-3;
  Vector e = residuals(x);
  for (int step = 0; step < 40 && lambda < 1e8; ++step) {
    Eigen::MatrixXd J(e.size(), x.size());
    for (Eigen::Index i = 0; i < x.size(); ++i) {
      constexpr double h = 1e-6;
      Vector a = x, b = x;
      a[i] += h;
      b[i] -= h;
      J.col(i) = (residuals(a) - residuals(b)) / (2 * h);
    }
    Eigen::MatrixXd H = J.transpose() * J;
    const Vector g = J.transpose() * e;
    const Vector diagonal = H.diagonal();
    for (; lambda < 1e8; lambda *= 10) {
      H.diagonal() = diagonal * (1 + lambda);
      const Vector next = x - H.ldlt().solve(g);
      const Vector next_e = residuals(next);
      if (!(next_e.squaredNorm() < e.squaredNorm())) continue;
      x = next;
      e = next_e;
      lambda *= 0.1;
      break;
    }
  }
  return std::sqrt(e.squaredNorm() / static_cast<double>(e.size()));
}

TEST(Erratum, printedOrderCannotFitARigThatMovesAndTurnsAndOursCan) {
  SimulationOptions s;
  s.generator = SimulationGenerator::tight;
  s.points = 15;
  s.poses = 6;
  s.noise = 0;
  Random random(41);
  for (int run = 0; run < 2; ++run) {
    SimulatedRig rig = simulate_rig(s, random);
    Vector start(6 * 6 + 3 * 15);
    const auto put = [&](Eigen::Index i, const Transform& T) {
      start.segment<6>(i) << log_so3(T.R), T.t;
    };
    put(0, rig.true_cameras[1]);
    for (Eigen::Index i = 1; i < 6; ++i) put(6 * i, rig.true_poses[static_cast<std::size_t>(i)]);
    for (Eigen::Index j = 0; j < 15; ++j)
      start.segment<3>(36 + 3 * j) = rig.true_points[static_cast<std::size_t>(j)];
    EXPECT_GT(fit([&](const Vector& v) { return printed_residuals(rig, v); }, start), 1.0)
        << "px a coordinate, from the true values";

    OwnAdjuster own(capacities_for(s));
    const BundleResult r = own.adjuster.solve(rig.problem(), calibration_options());
    ASSERT_TRUE(r.converged());
    EXPECT_LT(r.rms_px, 1e-11);
  }
}

TEST(Erratum, printedOrderMovesTheSecondCameraOnTheRig) {
  const Transform T1{exp_so3({0.010, -0.020, 0.005}), {-0.750, 0.003, 0.004}};
  const Transform forward{Mat3::Identity(), {0, 0, -10}},
      turned{exp_so3({0, 0.1, 0}), Vec3::Zero()};
  const auto relative = [&](const Transform& P) { return (P * T1) * P.inverse(); };
  EXPECT_GT((relative(forward).t - T1.t).norm(), 0.2);  // ten metres on, 20 mrad of yaw: 0.2 m
  EXPECT_GT((relative(turned).t - T1.t).norm(), 0.07);
  for (const Transform& P : {forward, turned})
    EXPECT_LT((((T1 * P) * P.inverse()).t - T1.t).norm(), 1e-14);
}

}  // namespace
}  // namespace vergence
