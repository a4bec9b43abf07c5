#include "core/calibration/posterior.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "core/math/random.hpp"
#include "core/math/so3.hpp"
#include "tests/support/parallel_rig.hpp"

namespace vergence::calibration {
namespace {

// The free parameters are the transform of camera 1 and its intrinsics.
constexpr int kFree = 15;
using Free = Eigen::Matrix<double, kFree, kFree>;
using FreeVector = Eigen::Matrix<double, kFree, 1>;

constexpr int row_of(int i) { return i < 6 ? extrinsic_row(1) + i : intrinsic_row(1) + i - 6; }

RigCalibration rig() {
  RigCalibration r = test::parallel_rig(test::pinhole(1024, 768, 1247), 0.75);
  r.T_camera_left[1].R = exp_so3({5e-3, -8e-3, 3e-3});
  return r;
}

/// Covariance of noise as a drive leaves it: all parameters correlated, t along the baseline exact.
Free covariance_of_noise(Random& random) {
  FreeVector sigma;
  sigma << 1e-4, 2e-4, 1e-4, 0, 1e-3, 1e-3, 0.5, 0.5, 1, 1, 1e-3, 1e-3, 2e-4, 2e-4, 1e-4;
  Free root = Free::Identity();
  for (int i = 0; i < kFree; ++i)
    for (int j = 0; j < i; ++j) root(i, j) = 0.4 * random.normal();
  Free C = sigma.asDiagonal() * root * root.transpose() * sigma.asDiagonal();
  return C;
}

RigCovariance published(const Free& C) {
  RigCovariance out;
  for (int i = 0; i < kFree; ++i)
    for (int j = 0; j <= i; ++j) out.set(row_of(i), row_of(j), C(i, j));
  return out;
}

/// Adds the uncertainty of camera 0's fixed focal lengths and principal point: D Σ Dᵀ, and −D Σ
/// beside it.
RigCovariance with_held(const Free& noise, Random& random) {
  Eigen::Matrix<double, kFree, 4> D;
  for (int i = 0; i < kFree; ++i)
    for (int j = 0; j < 4; ++j) D(i, j) = 3 * std::sqrt(noise(i, i)) * random.normal();
  Eigen::Vector4d variance(1.5, 1.5, 0.25, 0.25);
  RigCovariance out = published(noise + D * variance.asDiagonal() * D.transpose());
  for (int j = 0; j < 4; ++j) {
    out.set(intrinsic_row(0) + j, intrinsic_row(0) + j, variance[j]);
    for (int i = 0; i < kFree; ++i)
      out.set(row_of(i), intrinsic_row(0) + j, -D(i, j) * variance[j]);
  }
  return out;
}

RigCalibration moved(const RigCalibration& from, const FreeVector& by) {
  RigCalibration r = from;
  r.T_camera_left[1].R = exp_so3(by.head<3>()) * r.T_camera_left[1].R;
  r.T_camera_left[1].t += by.segment<3>(3);
  Intrinsics& lens = r.intrinsics[1];
  lens.fx += by[6], lens.fy += by[7], lens.cx += by[8], lens.cy += by[9];
  for (int i = 0; i < 5; ++i) lens.distortion[static_cast<std::size_t>(i)] += by[10 + i];
  return r;
}

// Where the lenses of all cameras are estimated, camera 0's go with each other.
TEST(Agreement, conditionalCovarianceOfCorrelatedIntrinsics) {
  Random random(86);
  using All = Eigen::Matrix<double, kFree + 4, kFree + 4>;
  All root;
  for (int i = 0; i < kFree + 4; ++i)
    for (int j = 0; j < kFree + 4; ++j) root(i, j) = random.normal();
  const All C = root * root.transpose();
  const auto row = [](int i) { return i < kFree ? row_of(i) : intrinsic_row(0) + i - kFree; };
  RigCovariance wide;
  for (int i = 0; i < kFree + 4; ++i)
    for (int j = 0; j <= i; ++j) wide.set(row(i), row(j), C(i, j));
  const Eigen::Matrix<double, kFree, 4> cross = C.topRightCorner<kFree, 4>();
  const Free given = C.topLeftCorner<kFree, kFree>() -
                     cross * C.bottomRightCorner<4, 4>().ldlt().solve(cross.transpose());
  const RigCovariance left = noise_only(wide);
  // The tolerance is for numbers near 20.
  for (int i = 0; i < kFree; ++i)
    for (int j = 0; j <= i; ++j)
      EXPECT_NEAR(left(row_of(i), row_of(j)), given(i, j), 1e-10) << i << ' ' << j;
  for (int j = 0; j < 4; ++j)
    for (int i = 0; i < kRigSize; ++i)
      EXPECT_NEAR(left(i, intrinsic_row(0) + j), 0, 1e-15) << i << ' ' << j;
}

// Both calibrations are drawn about one truth. With 1000 draws the mean of χ²(5)/5 has a standard
// error of 0.02, and the derivatives of a rig that is a sigma off differ by some hundredths.
TEST(Agreement, oneSigmaDifferencesAverageToOne) {
  Random random(84);
  const RigCalibration truth = rig();
  const Free noise_a = covariance_of_noise(random), noise_b = covariance_of_noise(random);
  const RigCovariance a_wide = with_held(noise_a, random), b_wide = with_held(noise_b, random);
  // Positive semidefinite (t along the baseline): the root by pivots.
  const auto root = [](const Free& C) -> Free {
    const Eigen::LDLT<Free> factor(C);
    Free L = factor.matrixL();
    L = L * factor.vectorD().cwiseMax(0).cwiseSqrt().asDiagonal();
    return factor.transpositionsP().transpose() * L;
  };
  const Free root_a = root(noise_a), root_b = root(noise_b);
  ASSERT_LT((root_a * root_a.transpose() - noise_a).norm(), 1e-12 * noise_a.norm());
  const auto draw = [&](const Free& L) {
    FreeVector z;
    for (int i = 0; i < kFree; ++i) z[i] = random.normal();
    return FreeVector(L * z);
  };
  constexpr int kDraws = 1000;
  double mean = 0;
  for (int i = 0; i < kDraws; ++i) {
    RigCalibration a = moved(truth, draw(root_a)), b = moved(truth, draw(root_b));
    a.covariance = a_wide;
    b.covariance = b_wide;
    mean += agreement(a, b, 1) / kDraws;
  }
  EXPECT_NEAR(mean, 1, 0.2);
}

}  // namespace
}  // namespace vergence::calibration
