#include "core/calibration/posterior.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/geometry/epipolar.hpp"
#include "core/math/linear_solve.hpp"
#include "core/math/so3.hpp"

namespace vergence::calibration {
namespace {

// Random walk of a pinhole's parameters, in focal lengths, relative to the rotation's; temperature
// causes both. Distortion coefficients have the random walk of the rotation.
constexpr double kPinholeOfDrift = 0.3;

void widen(RigCovariance* C, int row, double sigma) noexcept {
  if (C->known(row)) C->set(row, row, (*C)(row, row) + sigma * sigma);
}

}  // namespace

void let_drift(double hours, const CalibrationOptions& options, RigCalibration* rig) noexcept {
  const double angle =
      1e-3 * options.extrinsic_random_walk_mrad_per_sqrt_h * std::sqrt(std::max(0.0, hours));
  for (int k = 0; k < rig->cameras; ++k) {
    const auto c = static_cast<std::size_t>(k);
    const double length = rig->T_camera_left[c].t.norm();
    for (int i = 0; k > 0 && i < 6; ++i)
      widen(&rig->covariance, extrinsic_row(k) + i, i < 3 ? angle : angle * length);
    const int first = intrinsic_row(k);
    const double fx = rig->intrinsics[c].fx;
    for (int i = 0; i < kIntrinsicsSize; ++i)
      widen(&rig->covariance, first + i, i < 4 ? kPinholeOfDrift * angle * fx : angle);
  }
}

void assume_transforms(double sigma, RigCalibration* rig) noexcept {
  for (int k = 1; k < rig->cameras; ++k) {
    const double length = rig->T_camera_left[static_cast<std::size_t>(k)].t.norm();
    for (int i = 0; i < 6; ++i) {
      const int row = extrinsic_row(k) + i;
      for (int other = 0; other < kRigSize; ++other) rig->covariance.set(row, other, 0);
      const double own = i < 3 ? sigma : sigma * length;
      rig->covariance.set(row, row, own * own);
    }
  }
}

RigCovariance noise_only(const RigCovariance& wide) noexcept {
  RigCovariance noise = wide;
  for (int held = intrinsic_row(0); held < intrinsic_row(0) + 4; ++held) {
    const double variance = noise(held, held);
    // If only rounding is left of its variance, earlier parameters determine this one.
    constexpr double rounding = kRigSize * std::numeric_limits<double>::epsilon();
    if (!wide.known(held) || !(variance > rounding * wide(held, held))) continue;
    const RigCovariance before = noise;
    for (int r = 0; r < kRigSize; ++r)
      for (int c = 0; c <= r; ++c)
        noise.set(r, c, before(r, c) - before(r, held) * before(c, held) / variance);
  }
  return noise;
}

double agreement(const RigCalibration& a, const RigCalibration& b, int k) noexcept {
  const RigCovariance first = noise_only(a.covariance), second = noise_only(b.covariance);
  const auto c = static_cast<std::size_t>(k);
  // The transform's five parameters: rotation, and t along two directions orthogonal to it.
  const Transform &Ta = a.T_camera_left[c], &Tb = b.T_camera_left[c];
  Eigen::Matrix<double, 6, 5> basis = Eigen::Matrix<double, 6, 5>::Zero();
  basis.topLeftCorner<3, 3>().setIdentity();
  basis.bottomRightCorner<3, 2>() = tangent_basis(Ta.t.normalized());
  Vec6 way;
  way << log_so3(Tb.R * Ta.R.transpose()), Tb.t - Ta.t;
  Mat6 C;
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 6; ++j)
      C(i, j) = first(extrinsic_row(k) + i, extrinsic_row(k) + j) +
                second(extrinsic_row(k) + i, extrinsic_row(k) + j);
  const Mat5 own = basis.transpose() * C * basis;
  const Vec5 d = basis.transpose() * way;
  return d.dot(ldlt_solve(own, d)) / 5;
}

}  // namespace vergence::calibration
