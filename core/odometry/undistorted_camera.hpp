#pragma once
#include "core/camera/camera.hpp"

namespace vergence::odometry {

/// One camera of the odometry: features are followed in raw pixels, and computations use ideal
/// pinhole pixels (same K, no distortion).
class UndistortedCamera {
 public:
  UndistortedCamera() noexcept = default;
  explicit UndistortedCamera(const Intrinsics& k) noexcept
      : raw_(k), ideal_(without_distortion(k)), distorted_(k.has_distortion()) {}

  [[nodiscard]] const Camera& raw() const noexcept { return raw_; }
  [[nodiscard]] const Camera& ideal() const noexcept { return ideal_; }

  /// Converts a raw to an ideal pixel, with the magnification of short lengths. Returns false
  /// outside the lens model.
  [[nodiscard]] bool undistort(const Vec2& raw, Vec2* ideal, double* magnification) const noexcept;
  /// Computes the ray (x, y, 1) of a raw pixel and the derivative of x and y. Returns false outside
  /// the lens model.
  [[nodiscard]] bool ray_jacobian(const Vec2& raw, Vec3* ray, Mat2* J) const noexcept;

 private:
  [[nodiscard]] static Intrinsics without_distortion(Intrinsics k) noexcept {
    k.kind = CameraModelKind::pinhole_radtan;
    k.distortion = {};
    return k;
  }
  Camera raw_{}, ideal_{};
  bool distorted_ = false;
};

}  // namespace vergence::odometry
