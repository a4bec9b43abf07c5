#include "core/camera/camera.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/LU>

namespace vergence {
namespace {

// Tolerance in normalised units, about 1e-9 px.
constexpr double kUnprojectTolerance = 1e-12;
// Maximum normalised radius of a projected point with distortion: tan 76°.
constexpr double kMaxRadius = 4.0;

struct Radial {
  // Distorted over undistorted radius, and its derivative by r².
  double factor;
  double derivative;
};

Radial radtan_radial(const std::array<double, 5>& d, double r2) noexcept {
  return {1.0 + r2 * (d[0] + r2 * (d[1] + r2 * d[4])), d[0] + r2 * (2.0 * d[1] + r2 * 3.0 * d[4])};
}

struct Equidistant {
  // Distorted angle, and its derivative by θ.
  double theta_d;
  double derivative;
};

Equidistant equidistant_angle(const std::array<double, 5>& d, double theta) noexcept {
  const double t2 = theta * theta;
  return {theta * (1.0 + t2 * (d[0] + t2 * (d[1] + t2 * (d[2] + t2 * d[3])))),
          1.0 + t2 * (3.0 * d[0] + t2 * (5.0 * d[1] + t2 * (7.0 * d[2] + t2 * 9.0 * d[3])))};
}

/// Squared radius, at most kMaxRadius², up to which the distorted radius grows with the undistorted
/// one; beyond it the model folds back.
double monotonic_radius2(const Intrinsics& k) noexcept {
  constexpr int kSteps = 400;
  for (int i = 1; i <= kSteps; ++i) {
    const double r = kMaxRadius * i / kSteps;
    const double slope = k.kind == CameraModelKind::pinhole_radtan
                             ? radtan_radial(k.distortion, r * r).factor +
                                   2.0 * r * r * radtan_radial(k.distortion, r * r).derivative
                             : equidistant_angle(k.distortion, std::atan(r)).derivative;
    if (!(slope > 0.05)) return std::pow(kMaxRadius * (i - 1) / kSteps, 2);
  }
  return kMaxRadius * kMaxRadius;
}

}  // namespace

Camera::Camera(const Intrinsics& k) noexcept
    : k_(k),
      distorted_(k.has_distortion()),
      max_radius2_(k.has_distortion() ? monotonic_radius2(k) : 1e12) {}

bool Camera::distort(const Vec2& n, Vec2* out, Mat2* J) const noexcept {
  const double x = n.x(), y = n.y(), r2 = n.squaredNorm();
  if (!(r2 <= max_radius2_)) return false;
  const auto& d = k_.distortion;
  if (k_.kind == CameraModelKind::pinhole_radtan) {
    const auto [f, df] = radtan_radial(d, r2);
    const double p1 = d[2], p2 = d[3];
    *out = {x * f + 2 * p1 * x * y + p2 * (r2 + 2 * x * x),
            y * f + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y};
    if (J != nullptr) {
      const double cross = 2 * x * y * df + 2 * p1 * x + 2 * p2 * y;
      *J << f + 2 * x * x * df + 2 * p1 * y + 6 * p2 * x, cross, cross,
          f + 2 * y * y * df + 6 * p1 * y + 2 * p2 * x;
    }
    return true;
  }
  const double r = std::sqrt(r2);
  // θ_d/r tends to 1.
  if (r < 1e-9) {
    *out = n;
    if (J != nullptr) J->setIdentity();
    return true;
  }
  const auto [theta_d, slope] = equidistant_angle(d, std::atan(r));
  const double s = theta_d / r;
  *out = s * n;
  if (J != nullptr) {
    const double ds_dr = (slope / (1.0 + r2) - s) / r;
    *J = s * Mat2::Identity() + (ds_dr / r) * n * n.transpose();
  }
  return true;
}

ProjectStatus Camera::project(const Vec3& p, Vec2* pixel, Mat23* J) const noexcept {
  // The negated comparison also rejects NaN.
  if (!(p.z() >= kMinDepth)) return ProjectStatus::behind;
  const double iz = 1.0 / p.z();
  const Vec2 n(p.x() * iz, p.y() * iz);
  // The negated comparison also rejects NaN.
  if (!(n.squaredNorm() <= max_radius2_)) return ProjectStatus::folded;
  Vec2 d = n;
  Mat2 D = Mat2::Identity();
  if (distorted_ && !distort(n, &d, J != nullptr ? &D : nullptr)) return ProjectStatus::folded;
  *pixel = {k_.fx * d.x() + k_.cx, k_.fy * d.y() + k_.cy};
  if (J != nullptr) {
    const double a = k_.fx * iz, b = k_.fy * iz;
    *J << a * D(0, 0), a * D(0, 1), -a * (D(0, 0) * n.x() + D(0, 1) * n.y()),  //
        b * D(1, 0), b * D(1, 1), -b * (D(1, 0) * n.x() + D(1, 1) * n.y());
  }
  return ProjectStatus::ok;
}

bool Camera::unproject(const Vec2& pixel, Vec3* ray) const noexcept {
  const Vec2 target((pixel.x() - k_.cx) / k_.fx, (pixel.y() - k_.cy) / k_.fy);
  if (!target.allFinite()) return false;
  if (!distorted_) {
    *ray = {target.x(), target.y(), 1.0};
    return true;
  }
  // The equidistant model maps a half plane to a disc, so start with the radius as the angle, not
  // its tangent.
  Vec2 n = target;
  if (k_.kind == CameraModelKind::pinhole_equidistant) {
    const double radius = target.norm();
    if (radius > 1e-9) n *= std::tan(std::min(radius, 1.3)) / radius;
  }
  for (int i = 0; i < kUnprojectSteps; ++i) {
    Vec2 d;
    Mat2 J;
    while (!distort(n, &d,
                    // A step has left the monotonic range; shrink n, which terminates.
                    &J)) {
      n *= 0.8;
      if (n.squaredNorm() < 1e-12) return false;
    }
    const Vec2 error = target - d;
    if (error.squaredNorm() < kUnprojectTolerance * kUnprojectTolerance) {
      *ray = {n.x(), n.y(), 1.0};
      return true;
    }
    n += J.inverse() * error;
    if (!n.allFinite()) return false;
  }
  return false;
}

Eigen::Matrix<double, 2, 9> Camera::intrinsics_jacobian(const Vec3& p) const noexcept {
  const Vec2 n(p.x() / p.z(), p.y() / p.z());
  Vec2 d = n;
  if (distorted_) (void)distort(n, &d, nullptr);
  Eigen::Matrix<double, 2, 9> J = Eigen::Matrix<double, 2, 9>::Zero();
  J(0, 0) = d.x();
  J(1, 1) = d.y();
  J(0, 2) = 1;
  J(1, 3) = 1;
  const double r2 = n.squaredNorm();
  // Derivatives of the normalised distorted point.
  Eigen::Matrix<double, 2, 5> by_coefficient = Eigen::Matrix<double, 2, 5>::Zero();
  if (k_.kind == CameraModelKind::pinhole_radtan) {
    by_coefficient.col(0) = n * r2;
    by_coefficient.col(1) = n * (r2 * r2);
    by_coefficient.col(2) = Vec2(2 * n.x() * n.y(), r2 + 2 * n.y() * n.y());
    by_coefficient.col(3) = Vec2(r2 + 2 * n.x() * n.x(), 2 * n.x() * n.y());
    by_coefficient.col(4) = n * (r2 * r2 * r2);
  } else {
    const double r = std::sqrt(r2);
    if (r > 1e-9) {
      const double theta = std::atan(r);
      double power = theta * theta * theta / r;
      for (int i = 0; i < 4; ++i, power *= theta * theta) by_coefficient.col(i) = n * power;
    }
  }
  J.block<1, 5>(0, 4) = k_.fx * by_coefficient.row(0);
  J.block<1, 5>(1, 4) = k_.fy * by_coefficient.row(1);
  return J;
}

}  // namespace vergence
