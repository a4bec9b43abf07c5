#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace vergence::detail {

/// The real root of a x³ + b x² + c x + d where the cubic is steepest: the one that rounding of the
/// coefficients moves least.
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
  // Newton from beyond the outer turning point converges monotonically; which side: where the cubic
  // has its steep arm. x = y − b/3 turns it into y³ + p y + q.
  const double shift = b / 3.0;
  const double p = c - b * shift, q = (2.0 * shift * shift - c) * shift + d;
  // f(turning middle) = q: the root on the side opposite to q's sign is the outer, steep one (also
  // the only one). Upper bound of |y| for y³ + p y + q = 0 (Lagrange): max(2 √|p| …) is within a
  // factor 2 of the root.
  double y =
      -std::copysign(std::max(std::cbrt(2.0 * std::abs(q)), std::sqrt(2.0 * std::max(0.0, -p))), q);
  constexpr int kSteps = 12;  // from within a factor two: five or six quadratic steps; the rest is
                              // for a flat triple root
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

/// Real roots in [-1, 1] of Σ c[i] xⁱ, i ≤ Degree, ascending, where the polynomial changes its
/// sign; returns how many.
///
/// Between neighbouring critical points a polynomial is monotonic; those are the roots of its
/// derivative, found the same way from the linear one upwards. Each root: Newton, bisected where it
/// would leave its bracket, at most kSteps.
template <std::size_t Degree>
[[nodiscard]] std::size_t roots_in_unit_interval(const std::array<double, Degree + 1>& c,
                                                 std::array<double, Degree>* roots) noexcept {
  constexpr int kSteps = 60;  // bisection alone reaches the last bit of [-1, 1] in 54
  std::array<double, Degree + 1> critical{};
  std::size_t n = 0;
  for (std::size_t degree = 1; degree <= Degree; ++degree) {
    // The derivative of that degree, up to a common factor: d[i] ∝ c[i + m] (i + m)!/i!.
    const std::size_t m = Degree - degree;
    std::array<double, Degree + 1> d{};
    for (std::size_t i = 0; i <= degree; ++i) {
      d[i] = c[i + m];
      for (std::size_t f = i + 1; f <= i + m; ++f) d[i] *= static_cast<double>(f);
    }
    const auto at = [&d, degree](double x, double* slope) noexcept {
      double value = d[degree], first = 0;
      for (std::size_t i = degree; i-- > 0;) {
        first = first * x + value;
        value = value * x + d[i];
      }
      *slope = first;
      return value;
    };
    std::array<double, Degree + 1> found{};
    std::size_t count = 0;
    double lo = -1.0, slope = 0.0;
    double f_lo = at(lo, &slope);
    for (std::size_t k = 0; k <= n; ++k) {
      const double hi = k < n ? critical[k] : 1.0;
      const double f_hi = at(hi, &slope);
      if ((f_lo < 0.0) != (f_hi < 0.0)) {
        double a = lo, b = hi, x = 0.5 * (a + b);
        for (int step = 0; step < kSteps; ++step) {
          const double f = at(x, &slope);
          ((f < 0.0) == (f_lo < 0.0) ? a : b) = x;
          double next = x - f / slope;
          if (!(next > a && next < b)) next = 0.5 * (a + b);
          const double moved = std::abs(next - x);
          x = next;
          if (moved <= 1e-16) break;
        }
        found[count++] = x;
      }
      lo = hi;
      f_lo = f_hi;
    }
    critical = found;
    n = count;
  }
  for (std::size_t i = 0; i < n; ++i) (*roots)[i] = critical[i];
  return n;
}

}  // namespace vergence::detail
