#include "core/odometry/drift_covariance.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

namespace vergence::odometry {
namespace {

/// T_left_world of a camera at `centre`, turned about its y axis.
Transform looking(double yaw, const Vec3& centre) {
  const Mat3 R = exp_so3({0, -yaw, 0});
  return {R, -(R * centre)};
}

/// Noise of a step, translation first.
Mat6 noise(double metres, double radians) {
  Mat6 Q = Mat6::Zero();
  Q.diagonal().head<3>().setConstant(metres * metres);
  Q.diagonal().tail<3>().setConstant(radians * radians);
  return Q;
}

TEST(DriftCovariance, standingAddsOneStepPerMap) {
  DriftCovariance drift;
  const Mat6 step = noise(0.02, 0.001);
  for (int i = 0; i <= 100; ++i) drift.step(looking(0.3, {1, 2, 3}), step, 0.1, false);
  EXPECT_TRUE(drift.pose().isApprox(step, 1e-9)) << "measured against the same map";
  // A keyframe ends the first map, and the frames after it have their own error once.
  drift.step(looking(0.3, {1, 2, 3}), step, 0.1, true);
  for (int i = 0; i <= 100; ++i) drift.step(looking(0.3, {1, 2, 3}), step, 0.1, false);
  EXPECT_TRUE(drift.pose().isApprox(2 * step, 1e-9));
}

TEST(DriftCovariance, creepingAddsOneStepPerCertainPath) {
  DriftCovariance drift;
  constexpr double kSigma = 0.02;
  // 0.45 sigmas each: the seventh step is more than three sigmas from where it began.
  for (int i = 0; i <= 70; ++i)
    drift.step(looking(0, {0.45 * kSigma * i, 0, 0}), noise(kSigma, 1e-6), 0, false);
  // The turns lend the position no more than a millionth of the way, 0.6 m.
  EXPECT_NEAR(std::sqrt(drift.pose()(0, 0)), std::sqrt(10) * kSigma, 1e-6);
}

TEST(DriftCovariance, extrapolationEndsWithTheNextSeenPose) {
  DriftCovariance drift;
  const Mat6 seen = noise(0.02, 0.001), unseen = noise(5, 0.1);
  for (int i = 0; i <= 9; ++i) drift.step(looking(0, {0, 0, 1.0 * i}), seen, 0, true);
  const Mat6 before = drift.pose();
  for (int i = 0; i < 5; ++i) drift.step(looking(0, {0, 0, 9}), unseen, 0, false);
  EXPECT_TRUE(drift.pose().isApprox(before + unseen, 1e-9)) << "once: it is since the same pose";
  drift.step(looking(0, {0, 0, 9}), seen, 0, false);
  EXPECT_TRUE(drift.pose().isApprox(before + seen, 1e-9));
}

TEST(DriftCovariance, lengthErrorsAreCorrelated) {
  DriftCovariance drift;
  for (int i = 0; i <= 10; ++i) drift.step(looking(0, {0.5 * i, 0, 0}), Mat6::Zero(), 0.02, false);
  // Five metres along x, by 2 %.
  EXPECT_NEAR(std::sqrt(drift.pose()(0, 0)), 0.1, 1e-9);
}

TEST(DriftCovariance, sharedRotationErrorMovesThePoseSideways) {
  DriftCovariance drift;
  constexpr int kSteps = 100;
  for (int i = 0; i <= kSteps; ++i) drift.step(looking(0, {0, 0, 1.0 * i}), Mat6::Zero(), 0, false);
  const Mat6 P = drift.pose();
  const double turn = std::sqrt(P(4, 4));
  EXPECT_NEAR(turn, 2.6e-4 * kSteps, 1e-9);
  // A circle of that curvature: half of the turn times the way; 1 % for the steps' finite number.
  EXPECT_NEAR(std::sqrt(P(0, 0)), 0.5 * turn * kSteps, 0.01 * 0.5 * turn * kSteps);
  EXPECT_NEAR(P(2, 2), 0, 1e-12) << "to first order nothing along the way";
}

/// Against the errors of many drives round a bend, each step with its own noise.
TEST(DriftCovariance, covarianceMatchesManyRandomDrives) {
  constexpr int kDrives = 4000, kSteps = 20;
  constexpr double kMetres = 0.01, kRadians = 0.002;
  DriftCovariance drift;
  std::vector<Transform> exact;
  for (int i = 0; i <= kSteps; ++i) {
    exact.push_back(looking(0.05 * i, {0.2 * i, 0.1 * std::sin(0.3 * i), 1.0 * i}));
    drift.step(exact.back(), noise(kMetres, kRadians), 0, false);
  }
  // The error shared by all rotations is subtracted; this test is about the independent ones.
  DriftCovariance shared;
  for (const Transform& T : exact) shared.step(T, Mat6::Zero(), 0, false);
  const Mat6 expected = drift.pose() - shared.pose();
  std::mt19937_64 random(7);
  std::normal_distribution<double> normal;
  const auto any = [&](double sigma) {
    return Vec3(sigma * normal(random), sigma * normal(random), sigma * normal(random));
  };
  Mat6 measured = Mat6::Zero();
  const Transform T_world_left = exact.back().inverse();
  for (int n = 0; n < kDrives; ++n) {
    Transform T = exact[0];
    for (int i = 1; i <= kSteps; ++i) {
      const auto k = static_cast<std::size_t>(i);
      const Transform error{exp_so3(any(kRadians)), any(kMetres)};
      T = error * (exact[k] * exact[k - 1].inverse()) * T;
    }
    const Transform off = T.inverse();
    Vec6 e;
    e << off.t - T_world_left.t, log_so3(off.R * T_world_left.R.transpose());
    measured += e * e.transpose() / kDrives;
  }
  // A variance of n samples is known to √(2/n): five of that, and its share of the largest.
  const double tolerance = 5 * std::sqrt(2.0 / kDrives);
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 6; ++j)
      EXPECT_NEAR(measured(i, j), expected(i, j),
                  tolerance * std::sqrt(expected(i, i) * expected(j, j)))
          << i << ' ' << j;
}

TEST(MotionCovariance, extrapolatedMotionIsHalfUncertain) {
  const Transform moved{Mat3::Identity(), {0, 0, -3}};
  const Mat6 C = motion_covariance(Mat6::Zero(), moved, 0.5);
  // Half of 1 m/s² over half a second, in m.
  const double gathered = 0.5 * 0.5 * 0.5;
  EXPECT_NEAR(std::sqrt(C(2, 2)), std::hypot(1.5, gathered), 1e-12);
  EXPECT_NEAR(std::sqrt(C(4, 4)), 0.05, 1e-12);
  EXPECT_TRUE(motion_covariance(Mat6::Zero(), moved, 0).isZero());
  const Mat6 parked = motion_covariance(Mat6::Zero(), {}, 10 * 3600);
  EXPECT_GT(std::sqrt(parked(0, 0)), 1e6) << "anywhere";
  EXPECT_NEAR(std::sqrt(parked(3, 3)), std::numbers::pi, 1e-12) << "any way round";
}

TEST(MotionCovariance, motionBeyondTheExtrapolationIsIncluded) {
  // 25 m/s and 0.2 rad/s kept through eight seconds of darkness: two are carried on, 150 m and 1.2
  // rad are missing.
  const Transform carried{exp_so3({0, 0.2 * kLongestExtrapolation, 0}),
                          {0, 0, -25 * kLongestExtrapolation}};
  const Mat6 C = motion_covariance(Mat6::Zero(), carried, 8);
  EXPECT_GE(std::sqrt(C(2, 2)), 150);
  EXPECT_GE(std::sqrt(C(4, 4)), 1.2);
  // Up to there nothing is missing.
  const Mat6 whole = motion_covariance(Mat6::Zero(), carried, kLongestExtrapolation);
  EXPECT_NEAR(std::sqrt(whole(2, 2)), std::hypot(25, 2), 1e-12);
}

TEST(CorrectionCovariance, correctionIsOneSigma) {
  const Transform correction{exp_so3({0, 0.003, 0}), {0.1, 0, -0.2}};
  const Mat6 C = correction_covariance(correction);
  EXPECT_NEAR(std::sqrt(C(0, 0)), 0.1, 1e-12);
  EXPECT_NEAR(C(0, 2), -0.02, 1e-12);
  EXPECT_NEAR(std::sqrt(C(4, 4)), 0.003, 1e-12);
  EXPECT_TRUE(correction_covariance({}).isZero());
}

TEST(MotionCovariance, translationComesFirst) {
  Mat6 fit = Mat6::Zero();
  // The entry is the rotation about x.
  fit(0, 0) = 4;
  // The entry is the translation along z.
  fit(5, 5) = 1;
  const Mat6 C = motion_covariance(fit, {}, 0);
  EXPECT_GT(C(3, 3), 0);
  EXPECT_DOUBLE_EQ(C(3, 3), 4 * C(2, 2));
}

}  // namespace
}  // namespace vergence::odometry
