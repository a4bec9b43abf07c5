#pragma once
#include "core/math/so3.hpp"

namespace vergence {

/// A rigid transform written `T_to_from`: p_to = T_to_from * p_from = R p_from + t, metres.
///
/// Perturbations are on the left of the rotation and added to the translation: R ← Exp(φ) R, t ← t
/// + τ.
struct Transform {
  Mat3 R = Mat3::Identity();
  Vec3 t = Vec3::Zero();

  [[nodiscard]] Vec3 operator*(const Vec3& p) const noexcept { return R * p + t; }
  [[nodiscard]] Transform operator*(const Transform& o) const noexcept {
    return {R * o.R, R * o.t + t};
  }
  [[nodiscard]] Transform inverse() const noexcept;
  /// Camera centre (or body origin) of a world-to-camera transform, in world.
  [[nodiscard]] Vec3 centre() const noexcept;
  [[nodiscard]] bool finite() const noexcept;
};

/// Returns the transform perturbed by R ← Exp(φ) R, t ← t + τ.
[[nodiscard]] Transform perturbed(const Transform& T, const Vec3& phi, const Vec3& tau) noexcept;

/// Unit quaternion of a rotation with w ≥ 0, so that files are reproducible.
[[nodiscard]] Eigen::Quaterniond quaternion(const Mat3& R) noexcept;

/// Returns the camera after scaling the world by `factor` about a point.
[[nodiscard]] Transform scaled_about(const Transform& T_camera_world, const Vec3& centre,
                                     double factor) noexcept;

/// Interpolates from a (s = 0) to b (s = 1): position linearly, rotation along the shorter arc.
[[nodiscard]] Transform interpolate(const Transform& a, const Transform& b, double s) noexcept;

}  // namespace vergence
