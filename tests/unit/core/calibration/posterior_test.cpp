#include "core/calibration/posterior.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace vergence::calibration {
namespace {

/// Three cameras; of the second's transform and lens and the third's transform all is known,
/// everything going with everything.
RigCalibration known_rig() {
  RigCalibration rig{.cameras = 3};
  for (std::size_t k = 0; k < 3; ++k) rig.intrinsics[k].fx = rig.intrinsics[k].fy = 1000;
  rig.T_camera_left[1].t = {-0.75, 0, 0};
  rig.T_camera_left[2].t = {0, -0.5, 0};
  const auto fill = [&](int row, double sigma) {
    rig.covariance.set(row, row, sigma * sigma);
    for (int other = 0; other < row; ++other)
      if (rig.covariance.known(other))
        rig.covariance.set(row, other, 0.3 * sigma * std::sqrt(rig.covariance(other, other)));
  };
  for (int i = 0; i < 12; ++i) fill(extrinsic_row(1) + i, i % 6 < 3 ? 1e-4 : 1e-3);
  for (int i = 0; i < kIntrinsicsSize - 1; ++i) fill(intrinsic_row(1) + i, i < 4 ? 0.5 : 1e-3);
  return rig;
}

TEST(Posterior, driftAddsTheRandomWalkOfItsTime) {
  CalibrationOptions options{.extrinsic_random_walk_mrad_per_sqrt_h = 0.4};
  const RigCalibration before = known_rig();
  for (const double hours : {-1.0, 0.0, 1.0, 4.0}) {
    RigCalibration rig = before;
    let_drift(hours, options, &rig);
    const double walk = 0.4e-3 * 0.4e-3 * std::max(hours, 0.0);
    const auto added = [&](int row) {
      return rig.covariance(row, row) - before.covariance(row, row);
    };
    for (int i = 0; i < 3; ++i) {
      EXPECT_NEAR(added(extrinsic_row(1) + i), walk, 1e-9 * walk) << i;
      // The translation rotates by the same angle.
      EXPECT_NEAR(added(extrinsic_row(1) + 3 + i), walk * 0.75 * 0.75, 1e-9 * walk) << i;
      EXPECT_NEAR(added(extrinsic_row(2) + 3 + i), walk * 0.5 * 0.5, 1e-9 * walk) << i;
    }
    for (int i = 0; i < kIntrinsicsSize - 1; ++i)
      EXPECT_EQ(added(intrinsic_row(1) + i) > 0, hours > 0) << i;
    for (int r = 0; r < kRigSize; ++r)
      for (int c = 0; c < r; ++c)
        ASSERT_EQ(rig.covariance(r, c), before.covariance(r, c)) << "a walk of each by itself";
  }
}

TEST(Posterior, unknownParametersStayUnknown) {
  RigCalibration rig = known_rig();
  let_drift(10, {}, &rig);
  for (int i = 0; i < kIntrinsicsSize; ++i) {
    EXPECT_FALSE(rig.covariance.known(intrinsic_row(0) + i)) << i;
    EXPECT_FALSE(rig.covariance.known(intrinsic_row(2) + i)) << i;
  }
  EXPECT_FALSE(rig.covariance.known(intrinsic_row(1) + kIntrinsicsSize - 1));
  RigCalibration nothing = known_rig();
  nothing.covariance = {};
  let_drift(10, {}, &nothing);
  EXPECT_TRUE(nothing.covariance.empty());
}

TEST(Posterior, clearedTransformsKeepTheIntrinsics) {
  const RigCalibration before = known_rig();
  RigCalibration rig = before;
  assume_transforms(kUnknownTransform, &rig);
  for (int i = 0; i < 12; ++i) {
    const int row = extrinsic_row(1) + i;
    EXPECT_GE(rig.covariance(row, row), std::pow(i % 6 < 3 ? 0.1 : 0.1 * 0.5, 2))
        << "0.1 rad, and a tenth of the length";
    for (int other = 0; other < kRigSize; ++other)
      EXPECT_EQ(rig.covariance(row, other) != 0, other == row) << row << ' ' << other;
  }
  for (int r = kExtrinsicsSize; r < kRigSize; ++r)
    for (int c = kExtrinsicsSize; c <= r; ++c)
      ASSERT_EQ(rig.covariance(r, c), before.covariance(r, c));
  EXPECT_EQ(rig.T_camera_left[1].t, before.T_camera_left[1].t);
}

}  // namespace
}  // namespace vergence::calibration
