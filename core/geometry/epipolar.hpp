#pragma once
#include "core/math/se3.hpp"

namespace vergence {

using Mat5 = Eigen::Matrix<double, 5, 5>;

/// Perturbs the stereo transform by δ = (φ, α, β), rad: R ← Exp(φ) R, t ← |t| · normalised(t/|t| +
/// B (α, β)), with B the tangent basis of t/|t|. The length is unobservable and stays.
/// Precondition: |t| > 0.
[[nodiscard]] Transform moved_on_sphere(const Transform& T_right_left, const Vec5& delta) noexcept;

/// Essential matrix E = [t/|t|]× R with ray_rightᵀ E ray_left = 0; zero if |t| is.
[[nodiscard]] Mat3 essential_matrix(const Transform& T_right_left) noexcept;

/// Essential matrix with prepared derivatives, to share work among many matches.
///
/// With rays x = (x, y, 1) of the left and x' of the right camera, l = E x, k = Eᵀ x', n = x'ᵀ E x:
///
///     Sampson distance   n / √(l_x² + l_y² + k_x² + k_y²)
///     to the line        n / √(l_x² + l_y²)
///
/// The first (P. Sampson 1982) is the reprojection error to first order, the second the right
/// point's distance from the left one's epipolar line. Both are signed and in normalised units
/// (times the focal length: px). J is the derivative with respect to δ of moved_on_sphere().
/// Const after construction.
class EpipolarGeometry {
 public:
  explicit EpipolarGeometry(const Transform& T_right_left) noexcept;

  /// Returns false and leaves *value and *J unchanged at the epipole, where the line has no
  /// direction, or without a baseline. J may be null.
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
  // Unit vector.
  Vec3 t_;
  // Tangent basis of t_.
  Mat32 B_;
  bool valid_;
};

/// Computes the depths of a match along (x, y, 1) at the nearest points of the two rays:
/// depth_right · right = R (depth_left · left) + t. Returns false and writes nothing if the rays
/// are parallel.
[[nodiscard]] bool match_depths(const Transform& T_right_left, const Vec2& left, const Vec2& right,
                                double* depth_left, double* depth_right) noexcept;

}  // namespace vergence
