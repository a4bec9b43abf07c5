#include "core/calibration/posterior.hpp"

#include <algorithm>
#include <cmath>

namespace vergence::calibration {
namespace {

// Random walk of a pinhole's parameters, in focal lengths, relative to the rotation's; temperature
// causes both. Distortion coefficients walk as the rotation does.
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

}  // namespace vergence::calibration
