#pragma once
#include <array>
#include <span>

#include "core/math/se3.hpp"

namespace vergence {

/// Essential matrices, Frobenius norm √2: rayᵀ_right E ray_left = 0. None where the matches are not
/// finite or do not make five equations, as coincident ones, or all roots are complex.
struct FivePointSolutions {
  int count = 0;  // 0 … 10
  std::array<Mat3, 10> E{};
};

/// Relative pose from five matches, undistorted rays (x, y, 1).
///
/// E = x X + y Y + z Z + W over the null space of the five epipolar equations; det E = 0 and E Eᵀ E
/// − ½ tr(E Eᵀ) E = 0 are ten cubics; eliminated down to a 3×3 matrix of polynomials in z whose
/// determinant has degree ten (D. Nistér, "An Efficient Solution to the Five-Point Relative Pose
/// Problem", PAMI 26, 2004). Its real roots are isolated between critical points, and (x, y, z)
/// polished by Gauss–Newton on the ten cubics, which takes away what the elimination has rounded.
/// Threads pure. Memory none. Errors none; nothing that comes out is NaN.
[[nodiscard]] FivePointSolutions solve_five_point(const std::array<Vec2, 5>& left,
                                                  const std::array<Vec2, 5>& right) noexcept;

/// The one of E's four transforms that has most of the matches in front of both cameras, |t| =
/// baseline. Returns how many are; 0: none, *T_right_left untouched. Precondition: left.size() ==
/// right.size().
[[nodiscard]] int decompose_essential(const Mat3& E, std::span<const Vec2> left,
                                      std::span<const Vec2> right, double baseline,
                                      Transform* T_right_left) noexcept;

}  // namespace vergence
