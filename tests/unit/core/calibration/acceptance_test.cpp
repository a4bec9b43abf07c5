// Solutions that are compared with the calibration in use by epipolar lines and by depths.
#include <gtest/gtest.h>

#include "core/calibration/gates.hpp"
#include "tests/unit/core/calibration/feature_log.hpp"

namespace vergence::calibration {
namespace {

/// A solve that found the true rig, frames that it does not rest on, and a calibration in use that
/// is turned from it.
struct Review {
  // Last frame of the solve.
  static constexpr std::uint64_t kNewest = 5;
  // Sigma of the estimated rotation in rad.
  static constexpr double kSigma = 1e-4;

  test::FeatureDriveOptions drive;
  Arena arena;
  TrackLog log{20, 300, arena};
  CalibrationOptions options;
  RigCalibration truth = test::rig_of(drive), in_use = truth;
  RigSolution solved;

  explicit Review(const Vec3& turned) {
    test::FeatureDrive d(drive);
    test::log_drive(d, 20, {}, log);
    in_use.T_camera_left[1].R = exp_so3(turned) * truth.T_camera_left[1].R;
    solved = {.status = RigSolveStatus::ok,
              .rig = truth,
              .newest = kNewest,
              .frames = options.max_frames,
              .near = 1000,
              .travelled_m = 100};
    for (int row = extrinsic_row(1); row < extrinsic_row(1) + 3; ++row)
      solved.rig.covariance.set(row, row, kSigma * kSigma);
  }
  [[nodiscard]] Gate gate() const {
    return check_acceptance(
        {.solution = &solved, .nominal = &truth, .in_use = &in_use, .log = &log}, options);
  }
  [[nodiscard]] bool lines_tell() const { return fits_better(log, kNewest, truth, in_use); }
};

TEST(Acceptance, pitchIsAcceptedByEpipolarLines) {
  // The pitch moves every row by 0.7 px.
  const Review r({1e-3, 0, 0});
  EXPECT_TRUE(r.lines_tell());
  EXPECT_EQ(r.gate(), Gate::open);
}

// 1 mrad is 2.7 % of the depth at 20 m, which the solve holds to 0.27 %; of epipolar lines it moves
// those in the image's corners, by less than the matches scatter.
TEST(Acceptance, yawIsAcceptedByDepth) {
  for (const double yaw : {1e-3, -1e-3}) {
    const Review r({0, yaw, 0});
    ASSERT_FALSE(r.lines_tell()) << yaw;
    EXPECT_EQ(r.gate(), Gate::open) << yaw;
  }
}

// A measurement whose depth does not differ by more than chance leaves the calibration unchanged.
TEST(Acceptance, toleratedYawIsNoBetter) {
  for (const double yaw : {0.0, 1.5e-4, -1.5e-4})
    EXPECT_EQ(Review({0, yaw, 0}).gate(), Gate::no_better) << yaw;
}

}  // namespace
}  // namespace vergence::calibration
