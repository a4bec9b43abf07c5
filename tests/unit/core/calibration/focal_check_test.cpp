#include <gtest/gtest.h>

#include <cmath>

#include "core/calibration/gates.hpp"
#include "tests/unit/core/calibration/feature_log.hpp"

namespace vergence::test {
namespace {

using namespace calibration;

/// The rig of a drive with a focal length that is `factor` of the true one.
RigCalibration given_rig(const FeatureDriveOptions& drive, double factor) {
  RigCalibration rig = rig_of(drive, {drive.left, drive.right}, {});
  for (std::size_t k = 0; k < 2; ++k) {
    rig.intrinsics[k].fx *= factor;
    rig.intrinsics[k].fy *= factor;
  }
  return rig;
}

/// As the drive goes: with the lenses free, and from there with the focal lengths.
RigSolution measure(const FeatureDriveOptions& drive_options, const RigCalibration& given) {
  SolverInArena s({.max_frames = 60});
  FeatureDrive drive(drive_options);
  log_drive(drive, 60, {2e-3, 0.02, 5e-3, 0.02}, s.solver.log());
  const RigSolveRequest request{.rig = given, .given = &given};
  EXPECT_EQ(s.solver.solve(request).status, RigSolveStatus::ok);
  return s.solver.free_focal_lengths(request);
}

TEST(FocalCheck, trueFocalLengthIsNotContradicted) {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    FeatureDriveOptions drive{.seed = seed};
    const RigCalibration given = given_rig(drive, 1);
    const FocalMeasurement m = check_focal_length(measure(drive, given), given);
    ASSERT_GT(m.sigma_px, 0);
    EXPECT_FALSE(m.contradicted) << m.measured_px << " +- " << m.sigma_px;
    EXPECT_LT(std::abs(m.measured_px - drive.left.fx), 1.5 * m.sigma_px);
  }
}

// On a road that winds: two seconds straight on hold the focal length to a seventh only.
TEST(FocalCheck, wrongFocalLengthIsContradictedAndMeasured) {
  for (const double factor : {0.8, 1.25}) {
    FeatureDriveOptions drive{.rocking = 6};
    const RigCalibration given = given_rig(drive, factor);
    const FocalMeasurement m = check_focal_length(measure(drive, given), given);
    EXPECT_TRUE(m.contradicted) << m.measured_px << " +- " << m.sigma_px;
    EXPECT_EQ(m.configured_px, given.intrinsics[0].fx);
    ASSERT_GT(m.sigma_px, 0);
    EXPECT_LT(std::abs(m.measured_px - drive.left.fx), 1.5 * m.sigma_px);
  }
}

RigSolution found(RigSolveStatus status, double fx, double sigma) {
  RigSolution s{.status = status};
  s.rig.intrinsics[0].fx = fx;
  s.rig.intrinsics[0].sigma[0] = sigma;
  return s;
}

// Measurements are off by up to 4 % on recorded drives, whatever their sigma. With
// s² = 0.04² + sigma² and S² = 0.1² + sigma², another focal length is more probable beyond
// sqrt(log(S²/s²) / (1/s² - 1/S²)): 7.4 % with 40 px of 1076.
TEST(FocalCheck, contradictionNeedsFourPercentAndThreeSigmasAndDoubtThatAnotherIsMoreProbable) {
  struct Case {
    double fx, sigma;
    bool doubted, contradicted;
  };
  RigCalibration given;
  given.intrinsics[0].fx = 1000;
  for (const Case& c :
       {Case{1039, 1e-3, false, false}, Case{1041, 1e-3, true, true}, Case{959, 1e-3, true, true},
        Case{1070, 40, false, false}, Case{1076, 40, true, false}, Case{1140, 40, true, false},
        Case{1170, 40, true, true}}) {
    const FocalMeasurement m = check_focal_length(found(RigSolveStatus::ok, c.fx, c.sigma), given);
    EXPECT_EQ(m.doubted, c.doubted) << c.fx;
    EXPECT_EQ(m.contradicted, c.contradicted) << c.fx;
  }
}

TEST(FocalCheck, unconvergedSolveContradictsOnlyIfFar) {
  RigCalibration given;
  given.intrinsics[0].fx = 1000;
  const auto at = [&](double fx) {
    return check_focal_length(found(RigSolveStatus::not_converged, fx, 0), given);
  };
  EXPECT_FALSE(at(1050).contradicted);
  EXPECT_EQ(at(1050).measured_px, 0) << "nothing is known";
  EXPECT_TRUE(at(1110).contradicted);
  EXPECT_EQ(at(1110).sigma_px, 0);
}

TEST(FocalCheck, failedSolveMeasuresNothing) {
  RigCalibration given;
  given.intrinsics[0].fx = 1000;
  for (const RigSolveStatus status : {RigSolveStatus::too_few_tracks, RigSolveStatus::no_candidate,
                                      RigSolveStatus::not_observable}) {
    const FocalMeasurement m = check_focal_length(found(status, 500, 1), given);
    EXPECT_EQ(m.measured_px, 0);
    EXPECT_FALSE(m.contradicted);
  }
}

}  // namespace
}  // namespace vergence::test
