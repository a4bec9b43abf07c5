#include "core/math/se3.hpp"

namespace vergence {

Transform Transform::inverse() const noexcept { return {R.transpose(), -(R.transpose() * t)}; }

Vec3 Transform::centre() const noexcept { return -(R.transpose() * t); }

bool Transform::finite() const noexcept { return R.allFinite() && t.allFinite(); }

Transform perturbed(const Transform& T, const Vec3& phi, const Vec3& tau) noexcept {
  return {normalised(exp_so3(phi) * T.R), T.t + tau};
}

Eigen::Quaterniond quaternion(const Mat3& R) noexcept {
  Eigen::Quaterniond q(R);
  q.normalize();
  if (q.w() < 0) q.coeffs() *= -1.0;
  return q;
}

Transform scaled_about(const Transform& T_camera_world, const Vec3& centre,
                       double factor) noexcept {
  return {T_camera_world.R,
          -(T_camera_world.R * (centre + factor * (T_camera_world.centre() - centre)))};
}

Transform interpolate(const Transform& a, const Transform& b, double s) noexcept {
  return {Eigen::Quaterniond(a.R).slerp(s, Eigen::Quaterniond(b.R)).normalized().toRotationMatrix(),
          a.t + s * (b.t - a.t)};
}

}  // namespace vergence
