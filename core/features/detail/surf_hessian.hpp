#pragma once
#include "core/features/detail/surf_integral.hpp"

namespace vergence::features::detail {

/// Second derivatives of the image at (x, y), by boxes L px wide instead of a Gaussian of sigma 1.2
/// L/9 px, over L²: grey levels.
struct BoxHessian {
  float xx = 0, yy = 0, xy = 0;
  /// Approximate determinant; 0.9 compensates for the different approximation of the Gaussian by
  /// the boxes of xx and xy.
  [[nodiscard]] float determinant() const noexcept { return xx * yy - 0.81F * xy * xy; }
  /// Positive for a dark blob on a bright background.
  [[nodiscard]] float trace() const noexcept { return xx + yy; }
};

/// Precondition: L = 9, 15, 21, …, odd multiples of three; the L × L px around (x, y) are inside
/// the image.
[[nodiscard]] BoxHessian box_hessian(const IntegralImage& image, int x, int y, int L) noexcept;

/// Determinants at n positions of row y: x, x + step, …. Same preconditions for each of them.
void determinant_row(const IntegralImage& image, int x, int y, int L, int step, int n,
                     float* out) noexcept;

}  // namespace vergence::features::detail
