#pragma once
#include "core/features/detail/surf_integral.hpp"

namespace vergence::features::detail {

/// Second derivatives of the picture about (x, y), by boxes L px wide in place of a Gaussian's of
/// sigma 1.2 L/9 px, over L²: grey levels.
struct BoxHessian {
  float xx = 0, yy = 0, xy = 0;
  /// Approximates the determinant; 0.9 makes up for how differently the boxes of xx and xy resemble
  /// the Gaussian's.
  [[nodiscard]] float determinant() const noexcept { return xx * yy - 0.81F * xy * xy; }
  /// > 0: a dark blob on a bright ground.
  [[nodiscard]] float trace() const noexcept { return xx + yy; }
};

/// Precondition: L = 9, 15, 21, …, odd multiples of three; the L × L px about (x, y) lie inside the
/// picture.
[[nodiscard]] BoxHessian box_hessian(const IntegralImage& image, int x, int y, int L) noexcept;

/// Determinants at n places of row y: x, x + step, …. Preconditions as above for each of them.
void determinant_row(const IntegralImage& image, int x, int y, int L, int step, int n,
                     float* out) noexcept;

}  // namespace vergence::features::detail
