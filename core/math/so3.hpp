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

/// Rotation vector (axis × angle, rad) → rotation matrix, Rodrigues; a series below 1e-4 rad where
/// sin(θ)/θ loses digits.
[[nodiscard]] Mat3 exp_so3(const Vec3& phi) noexcept;

/// Rotation matrix → rotation vector with angle in [0, π]. Through the quaternion, so that angles
/// near π keep their digits.
[[nodiscard]] Vec3 log_so3(const Mat3& R) noexcept;

/// Angle of a rotation, rad, in [0, π].
[[nodiscard]] double rotation_angle(const Mat3& R) noexcept;

/// Left Jacobian: Exp(φ + δ) ≈ Exp(Jl(φ) δ) Exp(φ).
[[nodiscard]] Mat3 left_jacobian_so3(const Vec3& phi) noexcept;

/// Two unit vectors that span the plane perpendicular to a unit vector; the same for the same
/// input.
[[nodiscard]] Mat32 tangent_basis(const Vec3& unit) noexcept;

/// The rotation nearest to a matrix that has drifted from orthonormality by products.
[[nodiscard]] Mat3 normalised(const Mat3& R) noexcept;

}  // namespace vergence
