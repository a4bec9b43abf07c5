#pragma once
#include "core/calibration/detail/monitor_evidence.hpp"
#include "core/math/robust.hpp"
#include "core/math/se3.hpp"
#include "core/math/so3.hpp"

namespace vergence::calibration::detail {

/// Fits the frames' offsets θ_f from the reference by a constant and by exposures of the camera
/// that are late by a fraction δ of the interval between frames.
///
/// With T the transform of the camera, ω and v the rotation and translation of the left camera
/// since the previous frame, a late camera sees T exp(−δ (ω, v)). To first order this changes θ by
/// δ p, p = −(R ω, Bᵀ R v / |t|), B the tangent basis of moved_on_sphere(). A value.
class ExposureOffset {
 public:
  /// `frame`: evidence about θ at `T_camera_left`.
  void add(const Evidence& frame, const Transform& T_camera_left,
           const Transform& T_now_before) noexcept {
    const double length = T_camera_left.t.norm();
    Vec5 p;
    p << -(T_camera_left.R * log_so3(T_now_before.R)),
        -(tangent_basis(T_camera_left.t / length).transpose() *
          (T_camera_left.R * T_now_before.t)) /
            length;
    A_ += frame.A;
    g_ += frame.g;
    Ap_ += frame.A * p;
    pAp_ += p.dot(frame.A * p);
    pg_ += p.dot(frame.g);
    gain_ += gain(frame.A, frame.g);
  }

  /// Returns δ if it explains most of what the constant does not, else 0.
  [[nodiscard]] double frames() const noexcept {
    const Cholesky<5> factor = with_prior(A_);
    const double slope = pg_ - Ap_.dot(factor.solve(g_)),
                 square = pAp_ - Ap_.dot(factor.solve(Ap_)), all = gain_ - g_.dot(factor.solve(g_));
    return slope * slope > kMajority * square * all ? slope / square : 0;
  }

 private:
  // Sums over frames; with θ_f = A⁻¹ g, `gain_` is the sum of θᵀ A θ.
  Mat5 A_ = Mat5::Zero();
  Vec5 g_ = Vec5::Zero(), Ap_ = Vec5::Zero();
  double pAp_ = 0, pg_ = 0, gain_ = 0;
};

}  // namespace vergence::calibration::detail
