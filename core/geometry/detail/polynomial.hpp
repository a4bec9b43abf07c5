#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace vergence::detail {

/// Returns the real root of a x³ + b x² + c x + d at which the cubic is steepest, which is least
/// sensitive to rounding of the coefficients.
///
/// Precondition: finite. With a = 0 it returns the root of the remaining polynomial, or 0 if there
/// is none.
[[nodiscard]] inline double sharpest_cubic_root(double a, double b, double c, double d) noexcept {
  const double largest = std::max({std::abs(a), std::abs(b), std::abs(c), std::abs(d)});
  if (!(largest > 0.0)) return 0.0;
  if (std::abs(a) < 1e-14 * largest) {
    if (std::abs(b) < 1e-14 * largest) return c != 0.0 ? -d / c : 0.0;
    const double discriminant = std::max(0.0, c * c - 4.0 * b * d);
    const double q = -0.5 * (c + std::copysign(std::sqrt(discriminant), c));
    /// This is the smaller root.
    return q != 0.0 ? d / q : 0.0;
  }
  const double i = 1.0 / a;
  b *= i, c *= i, d *= i;
  // Newton's method converges monotonically from beyond the outer turning point, on the side of the
  // steep arm. x = y − b/3 gives y³ + p y + q.
  const double shift = b / 3.0;
  const double p = c - b * shift, q = (2.0 * shift * shift - c) * shift + d;
  // The value in the middle is q, so the root on the side opposite to q's sign is the steep (or
  // only) one. There either |p y| or |q| is at least |y|³/2, which bounds |y| within a factor 2.
  double y =
      -std::copysign(std::max(std::cbrt(2.0 * std::abs(q)), std::sqrt(2.0 * std::max(0.0, -p))), q);
  /// Five or six quadratic steps suffice from within a factor two; more are for a flat triple root.
  constexpr int kSteps = 12;
  for (int k = 0; k < kSteps; ++k) {
    const double f = (y * y + p) * y + q, slope = 3.0 * y * y + p;
    if (!(std::abs(slope) > 0.0)) break;
    const double step = f / slope;
    y -= step;
    if (std::abs(step) <= 1e-16 * std::abs(y)) break;
  }
  // One step on the unshifted cubic removes the rounding of the shift.
  double x = y - shift;
  const double slope = (3.0 * x + 2.0 * b) * x + c;
  if (slope != 0.0) {
    const double next = x - (((x + b) * x + c) * x + d) / slope;
    if (std::abs(next - x) < 1e-6 * (std::abs(x) + 1e-300)) x = next;
  }
  return x;
}

/// Finds the real roots in [-1, 1] of Σ c[i] xⁱ, i ≤ Degree, at which the polynomial changes its
/// sign, in ascending order. Returns their number.
///
/// A polynomial is monotonic between neighbouring critical points, which are the roots of its
/// derivative and are found the same way, from the linear one upwards. Each root takes at most
/// kSteps Newton steps, with bisection if a step would leave the bracket.
template <std::size_t Degree>
[[nodiscard]] std::size_t roots_in_unit_interval(const std::array<double, Degree + 1>& c,
                                                 std::array<double, Degree>* roots) noexcept {
  /// Bisection alone reaches the last bit of [-1, 1] in 54 steps.
  constexpr int kSteps = 60;
  std::array<double, Degree + 1> critical{};
  std::size_t n = 0;
  for (std::size_t degree = 1; degree <= Degree; ++degree) {
    // Derivative of that degree, up to a common factor: d[i] ∝ c[i + m] (i + m)!/i!.
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
