// Do the sigmas hold up? Fifty drives of five moving seconds below the level of images.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/core/calibration/feature_log.hpp"

namespace vergence::test {
namespace {

using namespace calibration;

// The frames are 5 s at 30 Hz.
constexpr int kDrives = 50, kFrames = 150;

CalibrationOptions held() {
  CalibrationOptions o{.intrinsics = calibration::IntrinsicsEstimation::fixed};
  // Nor are lengths off by what lenses usually are.
  o.focal_sigma_percent = o.principal_point_sigma_px = 0;
  return o;
}

// Variances are 3.5 times those of the clusters, for what tracks share in a way that no cluster
// shows; how much of it these drives have is not known, so squared errors of a length average to
// 1/3.5 to 1 of them. Three standard errors of a mean of fifty squares, 0.2 of it each, beyond.
constexpr double kMinLength = 0.4 / 3.5, kMaxLength = 1.6;

// 250 normal errors lie within two sigmas for 95 %, give or take 1.4; ninety leaves room for the
// drives being few.
TEST(RigSolverSigmas, sigmasMatchErrorsOverFiftyDrives) {
  SolverInArena s(held());
  // Mean of eᵀ C⁻¹ e over its dimension.
  double nees = 0;
  // Share of single errors within two sigmas.
  double within = 0;
  // Mean squared error of the path length over its sigma.
  double length = 0;
  for (int i = 0; i < kDrives; ++i) {
    FeatureDriveOptions o{.seed = 100 + static_cast<std::uint64_t>(i)};
    FeatureDrive drive(o);
    s.solver.log().clear();
    const double driven = log_drive(drive, kFrames, {2e-3, 0.02, 5e-3, 0.02}, s.solver.log());
    const RigSolution found = s.solver.solve({.rig = rig_of(o)});
    EXPECT_EQ(found.status, RigSolveStatus::ok) << i;
    const Vec5 e = five_errors(found.rig, o.T_right_left);
    const Mat5 C = five_covariance(found.rig.covariance_total[1]);
    nees += e.dot(C.ldlt().solve(e)) / 5 / kDrives;
    for (int k = 0; k < 5; ++k)
      within += std::abs(e[k]) < 2 * std::sqrt(C(k, k)) ? 1.0 / (5 * kDrives) : 0;
    length += std::pow((found.travelled_m / driven - 1) / found.rig.scale_sigma, 2) / kDrives;
  }
  EXPECT_GT(nees, 0.5);
  EXPECT_LT(nees, 2.0);
  EXPECT_GE(within, 0.90);
  EXPECT_GT(length, kMinLength);
  EXPECT_LT(length, kMaxLength);
}

}  // namespace
}  // namespace vergence::test
