#include "core/comparison/enu_alignment.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "core/math/random.hpp"

namespace vergence {
namespace {

const Duration kCorrelation = Duration::seconds(10);
// The camera looks east.
const Mat3 kCameraInEnu = (Mat3() << 0, 0, 1, -1, 0, 0, 0, -1, 0).finished();

Transform truth() { return {exp_so3({0.02, -0.03, 2.5}) * kCameraInEnu, {30, -40, 5}}; }

/// A drive forward (z of the world) with a bend, exact, 10 m/s.
std::vector<EnuAlignmentPair> drive(double length, double bend, int count,
                                    const Vec3& sigma = {2.5, 5.0, 0.0087}) {
  std::vector<EnuAlignmentPair> pairs;
  for (int i = 0; i < count; ++i) {
    const double s = length * i / (count - 1);
    const Vec3 place(bend * s * s / length, -0.01 * s, s);
    pairs.push_back({Stamp{} + Duration::seconds(s / 10.0), place, truth() * place, truth().R,
                     sigma[0], sigma[1], sigma[2]});
  }
  return pairs;
}

double rotation_error(const EnuAlignment& p) {
  return rotation_angle(p.T_enu_world.R * truth().R.transpose());
}

TEST(FitEnuAlignment, exactPairsGiveTheExactAlignment) {
  EnuAlignment alignment;
  const auto pairs = drive(100, 0.3, 200);
  ASSERT_EQ(fit_enu_alignment(pairs, kCorrelation, &alignment), EnuAlignmentStatus::ok);
  EXPECT_LT(rotation_error(alignment), 1e-10);
  for (const EnuAlignmentPair& p : pairs)
    EXPECT_LT((alignment.T_enu_world * p.p_world_left - p.p_enu_left).norm(), 1e-8);
  EXPECT_LT(alignment.residual, 1e-8);
  EXPECT_EQ(alignment.revision, 1U);
  EXPECT_EQ(alignment.pairs, 200);
}

TEST(FitEnuAlignment, headingAndPositionsAreWeightedBySigma) {
  const double wrong = 0.01;
  const auto turned = [&](double heading_sigma, double by) {
    auto pairs = drive(100, 0.0, 200);
    for (EnuAlignmentPair& p : pairs) {
      p.R_enu_world = exp_so3({0, 0, by}) * p.R_enu_world;
      p.heading_sigma = heading_sigma;
    }
    EnuAlignment alignment;
    EXPECT_EQ(fit_enu_alignment(pairs, kCorrelation, &alignment), EnuAlignmentStatus::ok);
    return alignment;
  };
  EXPECT_LT(rotation_error(turned(10.0, wrong)), 1e-3 * wrong);
  EXPECT_GT(rotation_error(turned(1e-5, wrong)), 0.98 * wrong);
  // As for the pitch: two independent places over 100 m hold the heading to σ √12 / (L √2).
  const double sigma = 2.5 * std::sqrt(12.0) / (100.0 * std::sqrt(2.0));
  EXPECT_NEAR(rotation_error(turned(sigma, wrong)), 0.5 * wrong, 0.02 * wrong);
  EXPECT_NEAR(turned(sigma, wrong).rotation_sigma.z(), sigma / std::sqrt(2.0), 0.02 * sigma);
  EXPECT_NEAR(turned(sigma, wrong).position_sigma.x(), 2.5 / std::sqrt(2.0), 0.01);
  EXPECT_LT(rotation_error(turned(1e-5, 1.0)), 1e-6) << "a mount that is no mount is not taken";
}

TEST(FitEnuAlignment, tiltAndPositionsAreWeightedBySigma) {
  // Positions say level; the attitude of the INS is pitched by 10 mrad across the way. The result
  // lies where the weights put it.
  const double wrong = 0.01;
  const auto pitched = [&](double tilt_sigma) {
    auto pairs = drive(100, 0.0, 200, {2.5, 5.0, tilt_sigma});
    // The road leads along R·z; the pitch axis is horizontal and across it.
    const Vec3 axis = Vec3::UnitZ().cross(truth().R.col(2)).normalized();
    for (EnuAlignmentPair& p : pairs) p.R_enu_world = exp_so3(wrong * axis) * p.R_enu_world;
    EnuAlignment alignment;
    EXPECT_EQ(fit_enu_alignment(pairs, kCorrelation, &alignment), EnuAlignmentStatus::ok);
    return rotation_error(alignment);
  };
  // The attitude has no weight.
  EXPECT_LT(pitched(1.0), 0.02 * wrong);
  // The attitude has all the weight.
  EXPECT_GT(pitched(1e-5), 0.98 * wrong);
  // Two independent heights over 100 m (10 s, correlation 10 s) hold the pitch to σ_h √12 / (L √2).
  const double sigma_pitch = 5.0 * std::sqrt(12.0) / (100.0 * std::sqrt(2.0));
  const double tilt = 0.1, expected = wrong / (1.0 + tilt * tilt / (sigma_pitch * sigma_pitch));
  EXPECT_NEAR(pitched(tilt), expected, 0.03 * expected);
}

TEST(FitEnuAlignment, sigmasMatchErrorsOfNoisyDrives) {
  // White errors and a correlation short enough that each pair counts: the squared error over the
  // variance averages to one a parameter.
  Random random(11);
  const int runs = 300;
  Vec3 nees = Vec3::Zero();
  for (int run = 0; run < runs; ++run) {
    auto pairs = drive(100, 0.3, 60, {2.5, 5.0, 0.0087});
    // The tilt error is constant during a drive.
    const Vec3 tilt(0.0087 * random.normal(), 0.0087 * random.normal(), 0);
    for (EnuAlignmentPair& p : pairs) {
      p.p_enu_left += Vec3(2.5 * random.normal(), 2.5 * random.normal(), 5.0 * random.normal());
      p.R_enu_world = exp_so3(tilt) * p.R_enu_world;
    }
    EnuAlignment alignment;
    ASSERT_EQ(fit_enu_alignment(pairs, Duration::milliseconds(1), &alignment),
              EnuAlignmentStatus::ok);
    nees += log_so3(alignment.T_enu_world.R * truth().R.transpose())
                .cwiseQuotient(alignment.rotation_sigma)
                .cwiseAbs2() /
            runs;
  }
  // χ² of 300 degrees of freedom over 300: σ = √(2/300) = 0.082; four of them, and the excess
  // factor may only widen the sigmas.
  for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(nees[axis], 1.0, 0.35) << axis;
}

TEST(FitEnuAlignment, residualsBeyondTheSigmasWidenTheResult) {
  Random random(5);
  auto pairs = drive(100, 0.3, 200, {0.01, 0.01, 1e-4});
  EnuAlignment exact, noisy;
  ASSERT_EQ(fit_enu_alignment(pairs, kCorrelation, &exact), EnuAlignmentStatus::ok);
  for (EnuAlignmentPair& p : pairs)
    p.p_enu_left += 0.1 * Vec3(random.normal(), random.normal(), random.normal());
  ASSERT_EQ(fit_enu_alignment(pairs, kCorrelation, &noisy), EnuAlignmentStatus::ok);
  EXPECT_NEAR(noisy.rotation_sigma.z() / exact.rotation_sigma.z(), 10.0, 1.0);
  EXPECT_NEAR(noisy.residual, 0.1 * std::sqrt(3.0), 0.02);
}

TEST(FitEnuAlignment, insufficientPairsGiveTheirStatus) {
  EnuAlignment alignment{.revision = 7};
  EXPECT_EQ(fit_enu_alignment(drive(100, 0.3, 2), kCorrelation, &alignment),
            EnuAlignmentStatus::too_few);
  // Half a metre is less than the position sigma of 2.5 m.
  EXPECT_EQ(fit_enu_alignment(drive(0.5, 0.0, 50), kCorrelation, &alignment),
            EnuAlignmentStatus::not_held);
  EXPECT_EQ(fit_enu_alignment(drive(0.0, 0.0, 50), kCorrelation, &alignment),
            EnuAlignmentStatus::not_held);
  auto pairs = drive(100, 0.3, 50);
  pairs[20].p_enu_left.x() = std::nan("");
  EXPECT_EQ(fit_enu_alignment(pairs, kCorrelation, &alignment), EnuAlignmentStatus::not_held);
  EXPECT_EQ(alignment.revision, 7U);
}

}  // namespace
}  // namespace vergence
