#pragma once
#include <algorithm>
#include <cmath>

namespace vergence::detail {

/// The real root of a x³ + b x² + c x + d where the cubic is steepest: the one that rounding of the coefficients moves least.
///
/// Precondition: finite. a = 0 is allowed; then the root of what is left, 0 when there is none.
[[nodiscard]] inline double sharpest_cubic_root(double a, double b, double c, double d) noexcept {
  const double largest = std::max({std::abs(a), std::abs(b), std::abs(c), std::abs(d)});
  if (!(largest > 0.0)) return 0.0;
  if (std::abs(a) < 1e-14 * largest) {
    if (std::abs(b) < 1e-14 * largest) return c != 0.0 ? -d / c : 0.0;
    const double discriminant = std::max(0.0, c * c - 4.0 * b * d);
    const double q = -0.5 * (c + std::copysign(std::sqrt(discriminant), c));
    return q != 0.0 ? d / q : 0.0;  // the smaller root
  }
  const double i = 1.0 / a;
  b *= i, c *= i, d *= i;
  // Newton from beyond the outer turning point converges monotonically; which side: where the cubic has its steep arm.
  // x = y − b/3 turns it into y³ + p y + q.
  const double shift = b / 3.0;
  const double p = c - b * shift, q = (2.0 * shift * shift - c) * shift + d;
  // f(turning middle) = q: the root on the side opposite to q's sign is the outer, steep one (also the only one).
  // Upper bound of |y| for y³ + p y + q = 0 (Lagrange): max(2 √|p| …) is within a factor 2 of the root.
  double y = -std::copysign(std::max(std::cbrt(2.0 * std::abs(q)), std::sqrt(2.0 * std::max(0.0, -p))), q);
  constexpr int kSteps = 12;  // from within a factor two: five or six quadratic steps; the rest is for a flat triple root
  for (int k = 0; k < kSteps; ++k) {
    const double f = (y * y + p) * y + q, slope = 3.0 * y * y + p;
    if (!(std::abs(slope) > 0.0)) break;
    const double step = f / slope;
    y -= step;
    if (std::abs(step) <= 1e-16 * std::abs(y)) break;
  }
  // One step on the unshifted cubic takes away what the shift has rounded.
  double x = y - shift;
  const double slope = (3.0 * x + 2.0 * b) * x + c;
  if (slope != 0.0) {
    const double next = x - (((x + b) * x + c) * x + d) / slope;
    if (std::abs(next - x) < 1e-6 * (std::abs(x) + 1e-300)) x = next;
  }
  return x;
}

}  // namespace vergence::detail
