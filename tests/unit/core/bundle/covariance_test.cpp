#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "tests/unit/core/bundle/bundle_fixture.hpp"

namespace vergence {
namespace {

/// Error of T_camera_left[1] against the ground truth.
Vec6 error_of(const SimulatedRig& rig) { return way(rig.true_cameras[1], rig.T_camera_left[1]); }

/// eᵀ C⁻¹ e in the space where C is not singular: with an exact length the direction of t is left
/// out.
double normalised_squared(const Vec6& e, const Mat6& C, const Vec3& t, bool exact) {
  if (!exact) return e.dot(C.ldlt().solve(e));
  const Vec3 u = t.normalized(), a = u.unitOrthogonal(), b = u.cross(a);
  Eigen::Matrix<double, 5, 6> J = Eigen::Matrix<double, 5, 6>::Zero();
  J.topLeftCorner<3, 3>().setIdentity();
  J.block<1, 3>(3, 3) = a.transpose();
  J.block<1, 3>(4, 3) = b.transpose();
  const Vec5 small = J * e;
  const Eigen::Matrix<double, 5, 5> own = J * C * J.transpose();
  return small.dot(own.ldlt().solve(small));
}

// The standard error of a mean of 1000 draws of χ²(5) is 0.100, of χ²(6) 0.110: three of them
// either way.
TEST(BundleCovariance, neesHasItsChiSquareMean) {
  SimulationOptions s = tight();
  s.points = 60;
  OwnAdjuster own(capacities_for(s));
  for (const bool exact : {true, false}) {
    Random random(exact ? 61 : 62);
    double sum = 0;
    for (int run = 0; run < 1000; ++run) {
      SimulatedRig rig = simulate_rig(s, random);
      BundleOptions o = with_covariance();
      if (!exact)
        o.length[1] = {BundleLength::measured,
                       rig.true_cameras[1].t.norm() + 1e-3 * random.normal(), 1e-3};
      const BundleResult r = own.adjuster.solve(rig.problem(), o);
      ASSERT_TRUE(r.converged() && r.has_covariance) << run;
      sum +=
          normalised_squared(error_of(rig), r.covariance_white[1], rig.T_camera_left[1].t, exact);
    }
    EXPECT_NEAR(sum / 1000, exact ? 5 : 6, exact ? 0.30 : 0.33);
  }
}

// Half of a track's noise is the same in all its images of one camera: white covariance is too
// small, that of clusters is not.
TEST(BundleCovariance, clustersCoverErrorsSharedByATrack) {
  SimulationOptions s = tight();
  s.points = 300;
  s.noise = 0.1;
  OwnAdjuster own(capacities_for(s));
  Random random(63);
  double white = 0, noise = 0;
  constexpr int kRuns = 150;
  for (int run = 0; run < kRuns; ++run) {
    SimulatedRig rig = simulate_rig(s, random);
    double constant[2][2] = {};
    std::uint32_t track = ~0U;
    for (BundleObservation& o : rig.observations) {
      if (o.point != track)
        for (auto& camera : constant)
          for (double& v : camera) v = 0.15 * random.normal();
      track = o.point;
      o.x += constant[o.camera][0];
      o.y += constant[o.camera][1];
    }
    const BundleResult r = own.adjuster.solve(rig.problem(), with_covariance());
    ASSERT_TRUE(r.converged() && r.has_covariance) << run;
    const Vec6 e = error_of(rig);
    white += normalised_squared(e, r.covariance_white[1], rig.T_camera_left[1].t, true) / kRuns;
    noise += normalised_squared(e, r.covariance_noise[1], rig.T_camera_left[1].t, true) / kRuns;
  }
  EXPECT_GT(noise, 4.0);
  EXPECT_LT(noise, 6.0);
  // Otherwise the errors above are not correlated enough to show a difference.
  EXPECT_GT(white, 1.5 * noise);
}

// Held intrinsics drawn from 0.5 px and 0.1 %: noise alone does not cover the error, the wide
// covariance does.
TEST(BundleCovariance, totalCovarianceCoversIntrinsicsErrors) {
  SimulationOptions s = tight();
  OwnAdjuster own(capacities_for(s));
  Random random(65);
  constexpr int kRuns = 300;
  double narrow = 0, wide = 0;
  for (int run = 0; run < kRuns; ++run) {
    SimulatedRig rig = simulate_rig(s, random);
    for (Camera& camera : rig.cameras) {
      Intrinsics k = camera.intrinsics();
      k.fx *= 1 + 1e-3 * random.normal();
      k.fy *= 1 + 1e-3 * random.normal();
      k.cx += 0.5 * random.normal();
      k.cy += 0.5 * random.normal();
      camera = Camera(k);
    }
    BundleOptions o = calibration_options();
    o.covariance = true;
    const BundleResult r = own.adjuster.solve(rig.problem(), o);
    ASSERT_TRUE(r.usable() && r.has_covariance) << run;
    const Vec6 e = error_of(rig);
    narrow += normalised_squared(e, r.covariance_noise[1], rig.T_camera_left[1].t, true) / kRuns;
    wide += normalised_squared(e, r.covariance_total[1], rig.T_camera_left[1].t, true) / kRuns;
  }
  EXPECT_GT(narrow, 50);
  // χ²(5) has a standard error of 0.18 over 300 runs; beyond it the linearisation about the wrong
  // intrinsics.
  EXPECT_GT(wide, 4.0);
  EXPECT_LT(wide, 6.0);
}

TEST(BundleCovariance, focalLengthSigmaMatchesItsErrors) {
  SimulationOptions s = tight();
  OwnAdjuster own(capacities_for(s));
  Random random(66);
  constexpr int kRuns = 200;
  double sum = 0;
  for (int run = 0; run < kRuns; ++run) {
    SimulatedRig rig = simulate_rig(s, random);
    const double f = rig.cameras[1].intrinsics().fx;
    BundleOptions o = with_covariance();
    o.intrinsics[1].free = 0b1;
    o.intrinsics[1].prior_mean[0] = f + 0.9 * random.normal();
    o.intrinsics[1].prior_sigma[0] = 0.9;
    Intrinsics start = rig.cameras[1].intrinsics();
    start.fx = o.intrinsics[1].prior_mean[0];
    rig.cameras[1] = Camera(start);
    const BundleResult r = own.adjuster.solve(rig.problem(), o);
    ASSERT_TRUE(r.converged() && r.has_covariance) << run;
    const double sigma = r.intrinsics_sigma[1][0];
    ASSERT_GT(sigma, 0);
    sum += std::pow((rig.cameras[1].intrinsics().fx - f) / sigma, 2) / kRuns;
  }
  // The standard error of χ²(1) over these runs is 0.1.
  EXPECT_NEAR(sum, 1.0, 0.3);
}

/// Mean of the newest pose's normalised squared error.
double newest_pose_error(BundleOptions o, int runs, std::uint64_t seed) {
  SimulationOptions s{.points = 60};
  OwnAdjuster own(capacities_for(s));
  Random random(seed);
  o.pose_covariance = true;
  double sum = 0;
  for (int run = 0; run < runs; ++run) {
    SimulatedRig rig = simulate_rig(s, random);
    if (o.configuration == BundleConfiguration::stereo_odometry)
      rig.T_camera_left = rig.true_cameras;
    const BundleResult r = own.adjuster.solve(rig.problem(), o);
    EXPECT_TRUE(r.converged() && r.has_pose_covariance) << run;
    if (!r.has_pose_covariance) break;
    EXPECT_EQ(r.pose, 9);
    const Transform &T = rig.T_left_world[9], &truth = rig.true_poses[9];
    const Mat3 turn = T.R * truth.R.transpose();
    Vec6 e;
    e << log_so3(turn), T.t - turn * truth.t;
    sum += e.dot(r.pose_covariance.ldlt().solve(e)) / runs;
  }
  return sum;
}

// Three standard errors of χ²(6) over 500 runs either way.
TEST(BundleCovariance, newestPoseCovarianceMatchesItsErrors) {
  EXPECT_NEAR(newest_pose_error({}, 500, 67), 6.0, 0.47);
  EXPECT_NEAR(newest_pose_error(calibration_options(), 500, 68), 6.0, 0.47);
}

}  // namespace
}  // namespace vergence
