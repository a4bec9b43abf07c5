#include "core/calibration/health.hpp"

#include <gtest/gtest.h>

#include "core/math/so3.hpp"
#include "tests/support/parallel_rig.hpp"

namespace vergence::calibration {
namespace {

/// Two cameras side by side that see little more than what is straight ahead: x/z within ±0.05.
RigCalibration narrow_rig() { return test::parallel_rig(test::pinhole(700, 500, 7000), 0.1); }

void know(RigCalibration* rig, std::size_t k, int what, double sigma) {
  rig->sigma_total[k][static_cast<std::size_t>(what)] = sigma;
  rig->covariance_total[k](what, what) = sigma * sigma;
}

TEST(Health, correlatedErrorsCancelInTheDepth) {
  RigCalibration rig = narrow_rig();
  const double z = 20, yaw = 1e-4;
  // A shift that moves what is straight ahead at 20 m back to where a yaw of the same sign took it
  // from: R X moves by ψ Z along x.
  know(&rig, 1, 1, yaw);
  know(&rig, 1, 3, yaw * z);
  rig.covariance_total[1](1, 3) = rig.covariance_total[1](3, 1) = -yaw * yaw * z;
  RigCalibration alone = rig;
  alone.covariance_total[1](1, 3) = alone.covariance_total[1](3, 1) = 0;
  EXPECT_LT(depth_error_percent(rig, 1, z), 0.01 * depth_error_percent(alone, 1, z));
}

TEST(Health, sigmasServeWithoutACovariance) {
  RigCalibration rig = narrow_rig();
  EXPECT_EQ(depth_error_percent(rig, 1, 20), 0);
  rig.sigma_total[1][1] = 1e-4;
  RigCalibration full = narrow_rig();
  know(&full, 1, 1, 1e-4);
  EXPECT_DOUBLE_EQ(depth_error_percent(rig, 1, 20), depth_error_percent(full, 1, 20));
}

TEST(Health, ratingFollowsTheErrorAtTwentyMetres) {
  const CalibrationOptions options;
  const auto word = [&](double percent) {
    RigCalibration rig = narrow_rig();
    know(&rig, 1, 3, 0.01 * percent * 0.1);
    return rating(rig, options);
  };
  EXPECT_EQ(word(1.99), "good");
  EXPECT_EQ(word(2.01), "fair");
  EXPECT_EQ(word(4.99), "fair");
  EXPECT_EQ(word(5.01), "poor");
}

TEST(Health, rigIsRatedByItsBestPair) {
  RigCalibration rig = narrow_rig();
  rig.cameras = 3;
  rig.intrinsics[2] = rig.intrinsics[1];
  rig.T_camera_left[2].t = Vec3(-0.05, 0, 0);
  // The depth errors are 1 % and 8 %.
  know(&rig, 1, 3, 0.001);
  know(&rig, 2, 3, 0.004);
  EXPECT_NEAR(depth_error_percent(rig, 20.0), 1.0, 1e-9);
  EXPECT_EQ(rating(rig, {}), "good");
  // The depth error is 20 %.
  know(&rig, 1, 3, 0.02);
  EXPECT_NEAR(depth_error_percent(rig, 20.0), 8.0, 1e-9);
  EXPECT_EQ(rating(rig, {}), "poor");
}

}  // namespace
}  // namespace vergence::calibration
