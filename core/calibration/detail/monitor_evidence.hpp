#pragma once
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "core/geometry/epipolar.hpp"
#include "core/math/types.hpp"

namespace vergence::calibration::detail {

/// θ of the monitor: φ (3, rad), α, β (rad: direction of t).
inline constexpr int kTheta = 5;
inline constexpr int kTriangle = kTheta * (kTheta + 1) / 2;

[[nodiscard]] constexpr std::size_t lower(int row, int column) noexcept {
  return static_cast<std::size_t>(row * (row + 1) / 2 + column);
}

using Theta = std::array<double, kTheta>;

/// Gradient and information of θ from some observations: with residuals r at θ = 0 and derivatives
/// J, weights w,
///   g = −Σ w Jᵀ r / σ²,   A = Σ w Jᵀ J / σ² (lower triangle, row by row),   n = Σ w / σ², 1/px².
/// All numbers add up over frames.
struct Evidence {
  Theta g{};
  std::array<double, kTriangle> A{};
  double n = 0;

  void add(const Evidence& e, double scale = 1.0) noexcept {
    for (std::size_t i = 0; i < g.size(); ++i) g[i] += scale * e.g[i];
    for (std::size_t i = 0; i < A.size(); ++i) A[i] += scale * e.A[i];
    n += scale * e.n;
  }
};

[[nodiscard]] inline Mat5 information(const Evidence& e) noexcept {
  Mat5 A;
  for (int i = 0; i < kTheta; ++i)
    for (int j = 0; j <= i; ++j) A(i, j) = A(j, i) = e.A[lower(i, j)];
  return A;
}

/// L Lᵀ = A and y = L⁻¹ g. Directions that nothing was seen of (pivot under 1e-9 of the diagonal)
/// stay out: y = 0 there.
struct Solved {
  std::array<double, kTriangle> L{};
  std::array<double, kTheta> y{};
  std::array<bool, kTheta> seen{};

  Solved(const std::array<double, kTriangle>& A, const Theta& g) noexcept {
    for (int i = 0; i < kTheta; ++i) {
      const auto ii = static_cast<std::size_t>(i);
      for (int j = 0; j <= i; ++j) {
        double s = A[lower(i, j)];
        for (int k = 0; k < j; ++k) s -= L[lower(i, k)] * L[lower(j, k)];
        if (j < i) {
          L[lower(i, j)] = seen[static_cast<std::size_t>(j)] ? s / L[lower(j, j)] : 0.0;
        } else {
          seen[ii] = s > 1e-9 * A[lower(i, i)] && s > 0;
          L[lower(i, i)] = seen[ii] ? std::sqrt(s) : std::numeric_limits<double>::infinity();
        }
      }
      double s = g[ii];
      for (int k = 0; k < i; ++k) s -= L[lower(i, k)] * y[static_cast<std::size_t>(k)];
      y[ii] = seen[ii] ? s / L[lower(i, i)] : 0.0;
    }
  }

  /// gᵀA⁻¹g.
  [[nodiscard]] double gain() const noexcept {
    double sum = 0;
    for (const double v : y) sum += v * v;
    return sum;
  }
};

}  // namespace vergence::calibration::detail
