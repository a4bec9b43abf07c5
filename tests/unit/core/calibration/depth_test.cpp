// Depths of two calibrations side by side, and what a joint covariance makes of a depth.
#include <gtest/gtest.h>

#include <cmath>

#include "core/calibration/health.hpp"
#include "core/math/so3.hpp"
#include "tests/support/parallel_rig.hpp"

namespace vergence::calibration {
namespace {

constexpr double kBaseline = 0.75, kFocal = 1247;

RigCalibration rig_with(double baseline, double focal, int width, int height) {
  return test::parallel_rig(test::pinhole(width, height, focal), baseline);
}

RigCalibration wide_rig() { return rig_with(kBaseline, kFocal, 1024, 768); }

void turn(RigCalibration* rig, const Vec3& angle) {
  rig->T_camera_left[1].R = exp_so3(angle) * rig->T_camera_left[1].R;
}

// A yaw δ moves what is straight ahead by f δ, at the edge of the image (x/z = 0.41) by f (1 + x²)
// δ; the disparity is f b / Z. So the inverse depth is off by Z δ (1 + x²) / b, relative, whatever
// the depth: of the root mean square over the image x² takes 6 %.
TEST(DepthDifference, yawErrorGrowsWithTheDepth) {
  for (const double yaw : {1e-3, -2e-3})
    for (const double z : {5.0, 10.0, 20.0, 50.0}) {
      const RigCalibration rig = wide_rig();
      RigCalibration off = rig;
      turn(&off, {0, yaw, 0});
      const double straight = 100 * z * std::abs(yaw) / kBaseline;
      EXPECT_NEAR(depth_error_percent(rig, off, 1, z), straight, 0.1 * straight) << yaw << ' ' << z;
    }
}

TEST(DepthDifference, lengthErrorIsItsShareAtEveryDepth) {
  const RigCalibration rig = wide_rig();
  RigCalibration longer = rig;
  longer.T_camera_left[1].t *= 1.01;
  // An equal disparity with a baseline 1 % longer is a depth 1 % larger.
  for (const double z : {5.0, 20.0, 50.0})
    EXPECT_NEAR(depth_error_percent(rig, longer, 1, z), 100 * (1 - 1 / 1.01), 1e-6) << z;
}

TEST(DepthDifference, depthUnseenByBothCamerasIsZero) {
  const RigCalibration rig = wide_rig();
  EXPECT_EQ(depth_error_percent(rig, rig, 1, 0.5), 0) << "1870 px of disparity";
}

TEST(DepthError, correlatedYawAndPrincipalPointCancel) {
  const double sigma = 1e-3;
  const int yaw = extrinsic_row(1) + 1, centre = intrinsic_row(1) + 2;
  RigCalibration alone = wide_rig();
  alone.covariance.set(yaw, yaw, sigma * sigma);
  RigCalibration both = alone;
  both.covariance.set(centre, centre, kFocal * kFocal * sigma * sigma);
  both.covariance.set(yaw, centre, -kFocal * sigma * sigma);
  RigCalibration apart = both;
  apart.covariance.set(yaw, centre, 0);
  const double of_yaw = depth_error_percent(alone, 1, 20);
  EXPECT_NEAR(of_yaw, 100 * 20 * sigma / kBaseline, 0.1 * of_yaw);
  EXPECT_LT(depth_error_percent(both, 1, 20), 0.1 * of_yaw);
  // Two independent errors, of the same size but for x².
  EXPECT_NEAR(depth_error_percent(apart, 1, 20), std::sqrt(2.0) * of_yaw, 0.1 * of_yaw);
}

// The gradient against the difference that it predicts, parameter by parameter: one small step of
// each.
TEST(DepthError, gradientMatchesTheDifferencePerParameter) {
  RigCalibration rig = wide_rig();
  turn(&rig, {0.01, -0.02, 0.005});
  for (std::size_t k = 0; k < 2; ++k)
    rig.intrinsics[k].distortion = {-0.1, 0.02, 1e-3, -5e-4, 0.01};
  const auto compare = [&](int row, double step, const RigCalibration& off) {
    RigCalibration known = rig;
    known.covariance = {};
    known.covariance.set(row, row, step * step);
    const double predicted = depth_error_percent(known, 1, 20),
                 made = depth_error_percent(rig, off, 1, 20);
    // Steps of some hundredths of a pixel: beyond the linear part is less than that of a disparity
    // of 47 px.
    EXPECT_NEAR(made, predicted, 2e-3 * predicted + 1e-6) << row;
  };
  for (int i = 0; i < 6; ++i) {
    const double step = i < 3 ? 2e-5 : 2e-4;
    RigCalibration off = rig;
    if (i < 3)
      turn(&off, step * Vec3::Unit(i));
    else
      off.T_camera_left[1].t += step * Vec3::Unit(i - 3);
    compare(extrinsic_row(1) + i, step, off);
  }
  for (int k = 0; k < 2; ++k)
    for (int i = 0; i < kIntrinsicsSize; ++i) {
      const double step = i < 4 ? 0.02 : 1e-4;
      RigCalibration off = rig;
      Intrinsics& lens = off.intrinsics[static_cast<std::size_t>(k)];
      const std::array place = {&lens.fx, &lens.fy, &lens.cx, &lens.cy};
      (i < 4 ? *place[static_cast<std::size_t>(i)]
             : lens.distortion[static_cast<std::size_t>(i - 4)]) += step;
      compare(intrinsic_row(k) + i, step, off);
    }
}

TEST(EvaluatedDepth, referenceDepthIsBoundedByTheDisparity) {
  const CalibrationOptions options;
  // A match of 0.15 px in both images is off by 0.21 px, 1 % of a disparity of 21.2 px.
  const double px = std::sqrt(2.0) * 0.15 / 0.01;
  EXPECT_NEAR(reference_depth_m(rig_with(0.11, 458, 752, 480), 1, options, 0.15), 458 * 0.11 / px,
              1e-9);
  EXPECT_LT(reference_depth_m(rig_with(0.11, 458, 752, 480), 1, options, 0.15), 20);
  EXPECT_EQ(reference_depth_m(wide_rig(), 1, options, 0.15), 20) << "44 m otherwise";
}

}  // namespace
}  // namespace vergence::calibration
