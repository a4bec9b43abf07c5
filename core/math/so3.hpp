#pragma once
#include <Eigen/Geometry>

#include "core/math/types.hpp"

namespace vergence {

/// [v]×: skew(v) * w == v × w.
[[nodiscard]] inline Mat3 skew(const Vec3& v) noexcept {
  Mat3 m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

/// Rotation matrix of a rotation vector (axis × angle, rad) by Rodrigues; below 1e-4 rad by a
/// series, because sin(θ)/θ loses precision.
[[nodiscard]] Mat3 exp_so3(const Vec3& phi) noexcept;

/// Rotation vector of a rotation matrix with its angle in [0, π], through the quaternion, which is
/// accurate near π.
[[nodiscard]] Vec3 log_so3(const Mat3& R) noexcept;

/// Angle of a rotation, rad, in [0, π].
[[nodiscard]] double rotation_angle(const Mat3& R) noexcept;

/// Two unit vectors that span the plane perpendicular to a unit vector, deterministically.
[[nodiscard]] Mat32 tangent_basis(const Vec3& unit) noexcept;

/// Rotation nearest to a matrix that products have made non-orthonormal.
[[nodiscard]] Mat3 normalised(const Mat3& R) noexcept;

}  // namespace vergence
