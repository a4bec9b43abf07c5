#include "core/odometry/drift_covariance.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "core/math/linear_solve.hpp"
#include "core/math/robust.hpp"

namespace vergence::odometry {
namespace {

// The constants are measured on recorded sequences and on rendered ones with exact ground truth
// (covariance_bench).
constexpr double kFitInflation = 3;
// Sigma of the shared rotation in rad per metre (0.015°).
constexpr double kSharedTurn = 2.6e-4;
// Sigma of an extrapolated translation, as a share of it.
constexpr double kExtrapolatedShare = 0.5;
// Sigma of a vehicle's unseen change of rotation rate, in rad/s.
constexpr double kExtrapolatedTurn = 0.1;
// Sigma of a vehicle's unseen acceleration, in m/s².
constexpr double kUnknownAcceleration = 1;

/// Adjoint of T for perturbations δ = (τ, φ): Exp(δ') T = T Exp(δ), δ' = A δ.
Mat6 adjoint(const Transform& T) noexcept {
  Mat6 A = Mat6::Zero();
  A.topLeftCorner<3, 3>() = A.bottomRightCorner<3, 3>() = T.R;
  A.topRightCorner<3, 3>() = skew(T.t) * T.R;
  return A;
}

/// Reorders a covariance from (φ, τ) to (τ, φ).
Mat6 translation_first(const Mat6& C) noexcept {
  Mat6 out;
  out << C.bottomRightCorner<3, 3>(), C.bottomLeftCorner<3, 3>(), C.topRightCorner<3, 3>(),
      C.topLeftCorner<3, 3>();
  return out;
}

}  // namespace

Mat6 motion_covariance(const Mat6& fit, const Transform& T_now_before,
                       double extrapolated_s) noexcept {
  Mat6 Q = kFitInflation * kFitInflation * translation_first(fit);
  if (extrapolated_s > 0) {
    // Only the first kLongestExtrapolation seconds are extrapolated; at constant velocity the rest
    // adds the share `missing`.
    const double carried_s = std::min(extrapolated_s, kLongestExtrapolation);
    const double missing = (extrapolated_s - carried_s) / carried_s;
    const double way = T_now_before.t.norm(), turn = log_so3(T_now_before.R).norm();
    const double away = std::hypot(kExtrapolatedShare * way, missing * way,
                                   0.5 * kUnknownAcceleration * extrapolated_s * extrapolated_s);
    const double turned =
        std::min(std::hypot(kExtrapolatedTurn * extrapolated_s, missing * turn), std::numbers::pi);
    Q.diagonal().head<3>().array() += away * away;
    Q.diagonal().tail<3>().array() += turned * turned;
  }
  return Q;
}

Mat6 correction_covariance(const Transform& T_adjusted_fitted) noexcept {
  Vec6 e;
  e << T_adjusted_fitted.t, log_so3(T_adjusted_fitted.R);
  return e * e.transpose();
}

bool may_be_none(const Transform& T_now_before, const Mat6& motion) noexcept {
  Vec6 e;
  e << T_now_before.t, log_so3(T_now_before.R);
  if (e.isZero(0)) return true;
  const Cholesky<6> factor(motion);
  return factor.ok() && e.dot(factor.solve(e)) < kCertainSigmas * kCertainSigmas;
}

void DriftCovariance::step(const Transform& T_left_world, const Mat6& motion, double length_sigma,
                           bool map_changed) noexcept {
  if (!std::exchange(any_, true)) {
    now_.T_left_world = anchor_.T_left_world = T_left_world;
    return;
  }
  const Transform T_now_anchor = T_left_world * anchor_.T_left_world.inverse();
  const Mat6 A = adjoint(T_now_anchor);
  const Mat6 noise = A * anchor_.noise * A.transpose() + motion;
  // Keep it symmetric over millions of steps.
  now_.noise = 0.5 * (noise + noise.transpose());
  now_.shared = A * anchor_.shared;
  now_.shared.col(0).head<3>() += length_sigma * T_now_anchor.t;
  for (int axis = 0; axis < 3; ++axis)
    now_.shared(3 + axis, 1 + axis) += kSharedTurn * T_now_anchor.t.norm();
  now_.T_left_world = T_left_world;
  if (map_changed || !may_be_none(T_now_anchor, motion)) anchor_ = now_;
}

Mat6 DriftCovariance::pose() const noexcept {
  // With p_left = Exp(φ) (R p + t) + τ the camera is at C − Rᵀ τ, rotated about the world's axes by
  // −Rᵀ φ.
  const Mat6 both = now_.noise + now_.shared * now_.shared.transpose();
  Mat6 P;
  const Mat3 R = now_.T_left_world.R.transpose();
  for (int i = 0; i < 2; ++i)
    for (int j = 0; j < 2; ++j)
      P.block<3, 3>(3 * i, 3 * j) = R * both.block<3, 3>(3 * i, 3 * j) * R.transpose();
  return P;
}

}  // namespace vergence::odometry
