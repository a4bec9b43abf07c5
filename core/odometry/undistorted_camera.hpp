#pragma once
#include "core/camera/camera.hpp"

namespace vergence::odometry {

/// One camera as the odometry uses it: raw pixels to follow features in, ideal pinhole pixels (same
/// K, no distortion) to reckon with.
class UndistortedCamera {
 public:
  UndistortedCamera() noexcept = default;
  explicit UndistortedCamera(const Intrinsics& k) noexcept
      : raw_(k), ideal_(without_distortion(k)), distorted_(k.has_distortion()) {}

  [[nodiscard]] const Camera& raw() const noexcept { return raw_; }
  [[nodiscard]] const Camera& ideal() const noexcept { return ideal_; }

  /// Raw pixel → ideal pixel, and how much longer a short length is there. False: outside the lens
  /// model.
  [[nodiscard]] bool undistort(const Vec2& raw, Vec2* ideal, double* magnification) const noexcept;
  /// ∂(x, y of the ray (x, y, 1))/∂(raw pixel). False: outside the lens model.
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
