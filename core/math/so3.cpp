#include "core/math/so3.hpp"

#include <cmath>

namespace vergence {

Mat3 exp_so3(const Vec3& phi) noexcept {
  const double theta2 = phi.squaredNorm();
  // sin θ/θ and (1 − cos θ)/θ².
  double a, b;
  if (theta2 < 1e-8) {
    a = 1.0 - theta2 / 6.0;
    b = 0.5 - theta2 / 24.0;
  } else {
    const double theta = std::sqrt(theta2);
    a = std::sin(theta) / theta;
    const double s = std::sin(0.5 * theta);
    b = 2.0 * s * s / theta2;
  }
  const Mat3 K = skew(phi);
  return Mat3::Identity() + a * K + b * K * K;
}

Vec3 log_so3(const Mat3& R) noexcept {
  Eigen::Quaterniond q(R);
  if (q.w() < 0) q.coeffs() *= -1.0;
  const double n = q.vec().norm();
  if (n < 1e-12) return 2.0 * q.vec();
  return (2.0 * std::atan2(n, q.w()) / n) * q.vec();
}

double rotation_angle(const Mat3& R) noexcept { return log_so3(R).norm(); }

Mat32 tangent_basis(const Vec3& unit) noexcept {
  int smallest = 0;
  (void)unit.cwiseAbs().minCoeff(&smallest);
  Mat32 B;
  B.col(0) = unit.cross(Vec3::Unit(smallest)).normalized();
  B.col(1) = unit.cross(B.col(0));
  return B;
}

Mat3 normalised(const Mat3& R) noexcept {
  return Eigen::Quaterniond(R).normalized().toRotationMatrix();
}

}  // namespace vergence
