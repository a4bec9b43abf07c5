// Comparison of a measured rig with the one in use, and rigs that change among the frames of one
// solve.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/calibration/gates.hpp"
#include "tests/unit/core/calibration/feature_log.hpp"

namespace vergence::calibration {
namespace {

constexpr double kDegree = std::numbers::pi / 180, kPixelSigma = 0.15;

/// A measured rig that is the true one, and frames that it does not rest on.
struct Measured {
  test::FeatureDriveOptions drive;
  Arena arena;
  TrackLog log{20, 300, arena};
  CalibrationOptions options;
  CalibrationOrigin source = CalibrationOrigin::elsewhere;
  RigCalibration measured = test::rig_of(drive), current = measured;

  /// `sigma`: of its yaw, rad.
  explicit Measured(double sigma) {
    test::FeatureDrive d(drive);
    test::log_drive(d, 20, {}, log);
    const int yaw = extrinsic_row(1) + 1;
    measured.covariance.set(yaw, yaw, sigma * sigma);
  }
  [[nodiscard]] Assessment of(const Vec3& turned) {
    current = measured;
    current.T_camera_left[1].R = exp_so3(turned) * measured.T_camera_left[1].R;
    return assess(measured, current, source, log, 5, options, kPixelSigma);
  }
};

// At 20 m and 0.75 m of baseline a yaw ψ is 26.7 ψ of the depth: 2 % are 0.75 mrad.
TEST(Assessment, sameRigIsConfirmedWithASmallSigma) {
  Measured m(1e-4);
  const Assessment a = m.of(Vec3::Zero());
  EXPECT_EQ(a.depth_m, 20);
  EXPECT_LT(a.difference_percent, 1e-8);
  EXPECT_NEAR(a.sigma_percent, 0.267, 0.03);
  EXPECT_TRUE(a.verified);
  EXPECT_FALSE(a.contradicted);
  EXPECT_FALSE(a.better);
  EXPECT_FALSE(a.worse);
}

// A calibration that does not state its sigmas is off by 1 mrad where it is the rig's.
TEST(Assessment, wrongYawIsContradicted) {
  for (const double yaw : {8e-3, -8e-3, 20e-3}) {
    Measured m(1e-4);
    const Assessment a = m.of({0, yaw, 0});
    EXPECT_NEAR(a.difference_percent, 100 * 20 * std::abs(yaw) / 0.75,
                0.1 * 100 * 20 * std::abs(yaw) / 0.75);
    EXPECT_LT(a.log_odds, 0) << yaw;
    EXPECT_TRUE(a.contradicted) << yaw;
    EXPECT_TRUE(a.nearer) << yaw;
    EXPECT_FALSE(a.verified) << yaw;
    EXPECT_FALSE(a.worse) << yaw;
  }
}

TEST(Assessment, onlyIndependentSourceAddsEvidence) {
  Measured sharp(1e-4);
  // The differences are 1.3 % and 4 % of the depth.
  EXPECT_TRUE(sharp.of({0, 0.5e-3, 0}).verified);
  EXPECT_FALSE(sharp.of({0, 1.5e-3, 0}).verified);
  // The sigma is 1.6 %; with 1.6 % of difference the sum exceeds 2 %.
  Measured blunt(0.6e-3);
  EXPECT_TRUE(blunt.of({0, 0.6e-3, 0}).verified);
  blunt.source = CalibrationOrigin::this_drive;
  EXPECT_FALSE(blunt.of({0, 0.6e-3, 0}).verified);
}

TEST(Assessment, largeSigmaDecidesNothing) {
  for (const double yaw : {0.0, 1.5e-3, 5e-3}) {
    // A sigma of 27 % is no evidence about a rig that may be 15 mrad off.
    Measured m(10e-3);
    const Assessment a = m.of({0, yaw, 0});
    EXPECT_FALSE(a.verified) << yaw;
    EXPECT_FALSE(a.contradicted) << yaw;
    EXPECT_FALSE(a.nearer) << yaw;
  }
}

TEST(Assessment, wrongPitchIsDetectedOnHeldOutFrames) {
  Measured m(1e-4);
  // The pitch moves rows by 2.4 px and hardly changes the depth.
  const Assessment a = m.of({2e-3, 0, 0});
  EXPECT_TRUE(a.better);
  EXPECT_FALSE(a.worse);
  EXPECT_FALSE(a.contradicted);
  // Claim and measurement exchanged.
  const Assessment b = assess(m.current, m.measured, m.source, m.log, 5, m.options, kPixelSigma);
  EXPECT_FALSE(b.better);
  EXPECT_TRUE(b.worse);
}

RigSolution solve_with(const std::vector<test::RigChange>& changes, std::uint64_t seed,
                       RigCalibration* nominal) {
  test::FeatureDriveOptions o;
  o.seed = seed;
  o.changes = changes;
  test::SolverInArena s({.max_frames = 60, .intrinsics = IntrinsicsEstimation::fixed});
  test::FeatureDrive drive(o);
  test::log_drive(drive, 60, {}, s.solver.log());
  *nominal = test::rig_of(o);
  RigSolveRequest request{.rig = *nominal, .from_rig = true};
  return s.solver.solve(request);
}

// 0.2° are 4.4 px; a solve over both rigs ends between them.
TEST(GateRigChanged, rotationDuringTheFramesIsDated) {
  for (const Vec3& axis : {Vec3(1, 0, 0), Vec3(0, 0, 1), Vec3(0, 1, 0), Vec3(0.6, 0.6, 0.5)}) {
    RigCalibration nominal;
    const RigSolution s = solve_with({{30, 0.2 * kDegree * axis, Vec3::Zero(), 0}}, 11, &nominal);
    ASSERT_EQ(s.status, RigSolveStatus::ok);
    EXPECT_GE(s.changed_at, 20U) << axis.transpose();
    EXPECT_LE(s.changed_at, 40U) << axis.transpose();
    AcceptanceInput q{.solution = &s, .nominal = &nominal};
    EXPECT_EQ(check_acceptance(q, {}), Gate::rig_changed) << axis.transpose();
  }
}

TEST(GateRigChanged, unchangedRigHasNoChange) {
  for (const std::uint64_t seed : {11U, 12U, 13U, 14U}) {
    RigCalibration nominal;
    const RigSolution s = solve_with({}, seed, &nominal);
    ASSERT_EQ(s.status, RigSolveStatus::ok);
    EXPECT_EQ(s.changed_at, 0U) << seed;
    AcceptanceInput q{.solution = &s, .nominal = &nominal};
    EXPECT_NE(check_acceptance(q, {}), Gate::rig_changed) << seed;
  }
}

}  // namespace
}  // namespace vergence::calibration
