#pragma once
#include "core/math/se3.hpp"

namespace vergence {

using Mat5 = Eigen::Matrix<double, 5, 5>;

/// The stereo transform moved by δ = (φ, α, β), rad: R ← Exp(φ) R, t ← |t| · normalised(t/|t| + B
/// (α, β)), B the tangent basis of t/|t|. The length stays: two cameras do not see it.
/// Precondition: |t| > 0.
[[nodiscard]] Transform moved_on_sphere(const Transform& T_right_left, const Vec5& delta) noexcept;

/// E = [t/|t|]× R: ray_rightᵀ E ray_left = 0. Zero where |t| is.
[[nodiscard]] Mat3 essential_matrix(const Transform& T_right_left) noexcept;

/// E with its derivatives prepared, so that many matches share the work.
///
/// With rays x = (x, y, 1) of the left and x' of the right camera, l = E x, k = Eᵀ x', n = x'ᵀ E x:
///
///     Sampson distance   n / √(l_x² + l_y² + k_x² + k_y²)
///     to the line        n / √(l_x² + l_y²)
///
/// The first (P. Sampson 1982) is the reprojection error to first order, the second the right
/// point's distance from the left one's epipolar line.
/// Both are signed, in normalised units (times the focal length: px). J: derivative by δ of
/// moved_on_sphere().
/// Threads  Const after construction.
class EpipolarGeometry {
 public:
  explicit EpipolarGeometry(const Transform& T_right_left) noexcept;

  /// False: nothing is measured, as at the epipole, where the line has no direction, or without a
  /// baseline; *value and *J untouched. J may be null.
  [[nodiscard]] bool sampson(const Vec2& left, const Vec2& right, double* value,
                             Vec5* J) const noexcept;
  [[nodiscard]] bool to_line(const Vec2& left, const Vec2& right, double* value,
                             Vec5* J) const noexcept;
  [[nodiscard]] const Mat3& E() const noexcept { return E_; }

 private:
  template <bool kBothImages>
  [[nodiscard]] bool distance(const Vec2& left, const Vec2& right, double* value,
                              Vec5* J) const noexcept;

  Mat3 R_, E_;
  Vec3 t_;   // unit
  Mat32 B_;  // tangent basis of t_
  bool valid_;
};

/// Depths along (x, y, 1) of a match by the two rays' nearest points: depth_right · right = R
/// (depth_left · left) + t.
/// False: the rays are parallel; nothing written.
[[nodiscard]] bool match_depths(const Transform& T_right_left, const Vec2& left, const Vec2& right,
                                double* depth_left, double* depth_right) noexcept;

}  // namespace vergence
