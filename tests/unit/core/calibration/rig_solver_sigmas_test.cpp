// Do the sigmas hold up? Fifty drives of five moving seconds below the level of images.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "core/math/random.hpp"
#include "tests/unit/core/calibration/feature_log.hpp"

namespace vergence::test {
namespace {

using calibration::CalibrationOptions;
using calibration::RigSolution;
using calibration::RigSolveStatus;

constexpr int kDrives = 50, kFrames = 150;  // 5 s at 30 Hz

struct Statistics {
  double nees = 0;    // mean of eᵀ C⁻¹ e over its dimension
  double within = 0;  // share of single errors within two sigmas
  Vec5 rms = Vec5::Zero();
  double length = 0;  // mean squared error of the length driven over its sigma
};

Statistics drives(const CalibrationOptions& options, bool intrinsics_off) {
  SolverInArena s(options);
  Random random(20, 6);
  Statistics out;
  for (int i = 0; i < kDrives; ++i) {
    FeatureDriveOptions o;
    o.seed = 100 + static_cast<std::uint64_t>(i);
    const std::array<Pinhole, 2> believed = {o.left, o.right};
    RigCalibration rig = rig_of(o);
    if (intrinsics_off) {
      const double focal = 0.001 * o.left.fx, centre = 0.5;
      for (Pinhole* lens : {&o.left, &o.right}) {
        const double f = focal * random.normal();
        lens->fx += f;
        lens->fy += f;
        lens->cx += centre * random.normal();
        lens->cy += centre * random.normal();
      }
      rig = rig_of(o, believed, {focal, focal, centre, centre});
    }
    FeatureDrive drive(o);
    s.solver.log().clear();
    const double driven = log_drive(drive, kFrames, {2e-3, 0.02, 5e-3, 0.02}, s.solver.log());
    const RigSolution found = s.solver.solve(rig);
    EXPECT_EQ(found.status, RigSolveStatus::ok) << i;
    const Vec5 e = five_errors(found.rig, o.T_right_left);
    const Mat5 C = five_covariance(found.rig.covariance_wide[1]);
    out.nees += e.dot(C.ldlt().solve(e)) / 5;
    for (int k = 0; k < 5; ++k) out.within += std::abs(e[k]) < 2 * std::sqrt(C(k, k)) ? 1 : 0;
    out.rms += e.cwiseAbs2();
    const double longer = found.travelled_m / driven - 1;
    out.length += std::pow(longer / found.rig.scale_sigma, 2);
  }
  out.nees /= kDrives;
  out.length /= kDrives;
  out.within /= 5 * kDrives;
  out.rms = (out.rms / kDrives).cwiseSqrt();
  std::printf(
      "squared error over its dimension %.3f, %.1f %% within two sigmas; rms %.4f %.4f %.4f mrad, "
      "t_y %.3f t_z %.3f mm; squared error of the length over its variance %.3f\n",
      out.nees, 100 * out.within, 1e3 * out.rms[0], 1e3 * out.rms[1], 1e3 * out.rms[2],
      1e3 * out.rms[3], 1e3 * out.rms[4], out.length);
  return out;
}

CalibrationOptions held() {
  CalibrationOptions o;
  o.estimate_focal_lengths = 0;
  // Nor are lengths off by what lenses usually are.
  o.focal_sigma_percent = o.principal_point_sigma_px = 0;
  return o;
}

// Variances are 3.5 times those of the clusters, for what tracks share in a way that no cluster
// shows; how much of it these drives have is not known, so squared errors of a length average to
// 1/3.5 to 1 of them. Three standard errors of a mean of fifty squares, 0.2 of it each, beyond.
constexpr double kLeastLength = 0.4 / 3.5, kMostLength = 1.6;

// 250 normal errors lie within two sigmas for 95 %, give or take 1.4; ninety leaves room for the
// drives being few.
TEST(RigSolverSigmas, holdUpOverFiftyDrivesWithExactIntrinsics) {
  const Statistics s = drives(held(), false);
  EXPECT_GT(s.nees, 0.5);
  EXPECT_LT(s.nees, 2.0);
  EXPECT_GE(s.within, 0.90);
  EXPECT_GT(s.length, kLeastLength);
  EXPECT_LT(s.length, kMostLength);
}

TEST(RigSolverSigmas, wideOnesCoverIntrinsicsThatAreOff) {
  const Statistics s = drives(CalibrationOptions{}, true);
  EXPECT_GE(s.within, 0.90);
  EXPECT_GT(s.length, kLeastLength);
  EXPECT_LT(s.length, kMostLength);
}

}  // namespace
}  // namespace vergence::test
