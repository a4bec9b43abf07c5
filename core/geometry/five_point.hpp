#pragma once
#include <array>
#include <span>

#include "core/math/se3.hpp"

namespace vergence {

/// Essential matrices with Frobenius norm √2: rayᵀ_right E ray_left = 0. There are none if the
/// matches are not finite, do not give five independent equations (coincident ones), or all roots
/// are complex.
struct FivePointSolutions {
  /// Number of solutions, 0 … 10.
  int count = 0;
  std::array<Mat3, 10> E{};
};

/// Computes the relative pose from five matches of undistorted rays (x, y, 1).
///
/// With E = x X + y Y + z Z + W over the null space of the five epipolar equations, det E = 0 and E
/// Eᵀ E − ½ tr(E Eᵀ) E = 0 are ten cubics. They are eliminated to a 3×3 matrix of polynomials in z
/// whose determinant has degree ten (D. Nistér, "An Efficient Solution to the Five-Point Relative
/// Pose Problem", PAMI 26, 2004). Its real roots are isolated between critical points, and (x, y,
/// z) is refined by Gauss–Newton on the ten cubics to remove rounding. Pure. Results are never NaN.
[[nodiscard]] FivePointSolutions solve_five_point(const std::array<Vec2, 5>& left,
                                                  const std::array<Vec2, 5>& right) noexcept;

/// Chooses the one of E's four transforms that has most matches in front of both cameras, with |t|
/// = baseline. Returns their number; if 0, *T_right_left is unchanged. Precondition: left.size() ==
/// right.size().
[[nodiscard]] int decompose_essential(const Mat3& E, std::span<const Vec2> left,
                                      std::span<const Vec2> right, double baseline,
                                      Transform* T_right_left) noexcept;

}  // namespace vergence
