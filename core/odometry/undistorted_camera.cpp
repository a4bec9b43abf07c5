#include "core/odometry/undistorted_camera.hpp"

#include <cmath>

#include <Eigen/LU>

namespace vergence::odometry {

bool UndistortedCamera::ray_jacobian(const Vec2& raw, Vec3* ray, Mat2* J) const noexcept {
  if (!raw_.unproject(raw, ray)) return false;
  Vec2 pixel;
  Mat23 by_point;
  if (raw_.project(*ray, &pixel, &by_point) != ProjectStatus::ok) return false;
  // At depth 1, the point's x and y are those of the ray.
  const Mat2 forward = by_point.leftCols<2>();
  const double det = forward.determinant();
  if (!(std::abs(det) > 1.0)) return false;
  *J = forward.inverse();
  return true;
}

bool UndistortedCamera::undistort(const Vec2& raw, Vec2* ideal,
                                  double* magnification) const noexcept {
  if (!distorted_) {
    *ideal = raw;
    *magnification = 1.0;
    return true;
  }
  Vec3 ray;
  Mat2 J;
  if (!ray_jacobian(raw, &ray, &J)) return false;
  const Intrinsics& k = ideal_.intrinsics();
  *ideal = {k.fx * ray.x() + k.cx, k.fy * ray.y() + k.cy};
  *magnification = std::sqrt(std::abs(J.determinant()) * k.fx * k.fy);
  return true;
}

}  // namespace vergence::odometry
