#include "core/geometry/epipolar.hpp"

#include <cmath>

namespace vergence {
namespace {

// Minimum squared length of the line's normal: within 1e-10 of the epipole.
constexpr double kMinGradient2 = 1e-20;
// Minimum squared sine between two rays; below it they are parallel in double precision.
constexpr double kMinSine2 = 1e-20;

}  // namespace

Transform moved_on_sphere(const Transform& T, const Vec5& delta) noexcept {
  const double length = T.t.norm();
  const Vec3 unit = T.t / length;
  return {normalised(exp_so3(delta.head<3>()) * T.R),
          length * (unit + tangent_basis(unit) * delta.tail<2>()).normalized()};
}

Mat3 essential_matrix(const Transform& T) noexcept {
  const double length = T.t.norm();
  return length > 0 ? Mat3(skew(T.t / length) * T.R) : Mat3(Mat3::Zero());
}

EpipolarGeometry::EpipolarGeometry(const Transform& T) noexcept
    : R_(T.R), E_(essential_matrix(T)), t_(Vec3::UnitX()), B_(Mat32::Zero()) {
  const double length = T.t.norm();
  valid_ = length > 0 && T.finite();
  if (valid_) {
    t_ = T.t / length;
    B_ = tangent_basis(t_);
  }
}

template <bool kBothImages>
bool EpipolarGeometry::distance(const Vec2& left, const Vec2& right, double* value,
                                Vec5* J) const noexcept {
  if (!valid_) return false;
  const Vec3 x1 = left.homogeneous(), x2 = right.homogeneous();
  const Vec3 turned = R_ * x1;
  const Vec3 l = t_.cross(turned);
  const Vec3 w = x2.cross(t_);
  const Vec3 k = R_.transpose() * w;
  const double n = x2.dot(l);
  double s = l.head<2>().squaredNorm();
  if constexpr (kBothImages) s += k.head<2>().squaredNorm();
  if (!(s > kMinGradient2)) return false;
  const double i = 1.0 / std::sqrt(s);
  *value = n * i;
  if (J == nullptr) return true;
  // l = t × (R x): ∂/∂φ = −[t]× [R x]×, ∂/∂(α, β) = −[R x]× B. k = Rᵀ (x' × t): ∂/∂φ = Rᵀ [w]×,
  // ∂/∂(α, β) = Rᵀ [x']× B. ds is ½ ∂s/∂δ.
  Eigen::Matrix<double, 3, 5> dl;
  const Mat3 Y = skew(turned);
  dl.leftCols<3>() = -skew(t_) * Y;
  dl.rightCols<2>() = -Y * B_;
  Vec5 ds = dl.topRows<2>().transpose() * l.head<2>();
  if constexpr (kBothImages) {
    Eigen::Matrix<double, 3, 5> dk;
    dk.leftCols<3>() = R_.transpose() * skew(w);
    dk.rightCols<2>() = R_.transpose() * (skew(x2) * B_);
    ds += dk.topRows<2>().transpose() * k.head<2>();
  }
  *J = i * (dl.transpose() * x2) - (n * i * i * i) * ds;
  return true;
}

bool EpipolarGeometry::sampson(const Vec2& left, const Vec2& right, double* value,
                               Vec5* J) const noexcept {
  return distance<true>(left, right, value, J);
}

bool EpipolarGeometry::to_line(const Vec2& left, const Vec2& right, double* value,
                               Vec5* J) const noexcept {
  return distance<false>(left, right, value, J);
}

bool match_depths(const Transform& T, const Vec2& left, const Vec2& right, double* depth_left,
                  double* depth_right) noexcept {
  const Vec3 a = T.R * left.homogeneous(), b = right.homogeneous();
  const Vec3 c = a.cross(b);
  const double c2 = c.squaredNorm();
  if (!(c2 > kMinSine2 * a.squaredNorm() * b.squaredNorm())) return false;
  // Cross products of λ_r b = λ_l a + t with b and a eliminate one depth each.
  *depth_left = b.cross(T.t).dot(c) / c2;
  *depth_right = a.cross(T.t).dot(c) / c2;
  return true;
}

}  // namespace vergence
