#pragma once
#include <algorithm>
#include <cmath>

#include "core/calibration/posterior.hpp"
#include "core/geometry/epipolar.hpp"
#include "core/math/linear_solve.hpp"
#include "core/math/types.hpp"

namespace vergence::calibration::detail {

/// Size of the monitor's θ: rotation φ (3, rad) and the direction of t by α and β (rad).
inline constexpr int kTheta = 5;
/// Rate of a fast running mean of widths, per frame: over ten frames, a second of the slowest rigs.
inline constexpr double kFastUpdate = 0.1;

/// Gradient g, information A and weight n (1/px²) of θ from observations with residuals r at θ = 0,
/// derivatives J and weights w: g = −Σ w Jᵀ r / σ², A = Σ w Jᵀ J / σ², n = Σ w / σ². All numbers
/// add up over frames.
struct Evidence {
  Vec5 g = Vec5::Zero();
  Mat5 A = Mat5::Zero();
  double n = 0;

  void add(const Evidence& e, double scale = 1.0) noexcept {
    g += scale * e.g;
    A += scale * e.A;
    n += scale * e.n;
  }
};

/// Factorises A with the prior of an unknown transform, which keeps unobserved directions at zero.
[[nodiscard]] inline Cholesky<5> with_prior(const Mat5& A) noexcept {
  return Cholesky<5>(A + Mat5::Identity() / (kUnknownTransform * kUnknownTransform));
}

/// Displacement of matches by θ = A⁻¹ g, px rms over the image.
[[nodiscard]] inline double shift_px(const Evidence& e) noexcept {
  const Vec5 theta = with_prior(e.A).solve(e.g);
  return e.n > 0 ? std::sqrt(std::max(0.0, theta.dot(e.A * theta)) / e.n) : 0;
}

/// gᵀ A⁻¹ g.
[[nodiscard]] inline double gain(const Mat5& A, const Vec5& g) noexcept {
  return g.dot(with_prior(A).solve(g));
}

}  // namespace vergence::calibration::detail
