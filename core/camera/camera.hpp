#pragma once
#include "core/types/calibration.hpp"

namespace vergence {

enum class ProjectStatus : std::uint8_t {
  ok,
  behind,  // depth under kMinDepth, or not a number
  folded,  // beyond the angle where the distortion model stops being monotonic, or x or y not a
           // number: no image there
};

inline constexpr double kMinDepth = 1e-3;  // m: nearer than any lens

/// One camera's projection with derivatives; a value, cheap to copy, fixed memory.
///
/// radtan       x_d = x (1 + k1 r² + k2 r⁴ + k3 r⁶) + 2 p1 x y + p2 (r² + 2x²), likewise y; r² = x²
/// + y², (x, y) = (X, Y)/Z equidistant  θ = atan r, θ_d = θ (1 + k1 θ² + k2 θ⁴ + k3 θ⁶ + k4 θ⁸),
/// (x_d, y_d) = (x, y) θ_d / r pixel        (fx x_d + cx, fy y_d + cy)
///
///     const Camera camera(intrinsics);
///     Vec2 pixel;
///     Mat23 d_pixel_d_point;
///     if (camera.project({1, -0.5, 8}, &pixel, &d_pixel_d_point) != ProjectStatus::ok) return;
///     Vec3 ray;
///     if (!camera.unproject(pixel, &ray)) return;  // 8 * ray is the point again
///
/// Threads    Const after construction.
class Camera {
 public:
  Camera() noexcept = default;
  explicit Camera(const Intrinsics& k) noexcept;

  /// Point in the camera's frame, m → pixel. J (2×3, may be null): ∂pixel/∂p, distortion included.
  /// Not `ok`: pixel and J untouched.
  [[nodiscard]] ProjectStatus project(const Vec3& p, Vec2* pixel, Mat23* J) const noexcept;

  /// Pixel → ray (x, y, 1) with (x, y) undistorted, by Newton from the distorted point, at most
  /// kUnprojectSteps.
  /// False: no convergence, or outside the model's monotonic range; *ray untouched.
  [[nodiscard]] bool unproject(const Vec2& pixel, Vec3* ray) const noexcept;

  /// ∂pixel/∂(fx, fy, cx, cy, d0 … d4) at p. Precondition: project(p) is ok.
  [[nodiscard]] Eigen::Matrix<double, 2, 9> intrinsics_jacobian(const Vec3& p) const noexcept;

  [[nodiscard]] const Intrinsics& intrinsics() const noexcept { return k_; }
  /// Inside the image with a border of `margin` px.
  [[nodiscard]] bool inside(const Vec2& pixel, double margin) const noexcept {
    return pixel.x() >= margin && pixel.y() >= margin && pixel.x() <= k_.width - 1 - margin &&
           pixel.y() <= k_.height - 1 - margin;
  }

 private:
  /// Normalised undistorted point → normalised distorted point and ∂distorted/∂undistorted.
  [[nodiscard]] bool distort(const Vec2& n, Vec2* d, Mat2* J) const noexcept;

  Intrinsics k_{};
  bool distorted_ = false;
  double max_radius2_ = 0;  // of the undistorted normalised point: the model is monotonic inside
};

inline constexpr int kUnprojectSteps =
    12;  // Newton converges quadratically; 4 to 6 are used in a strongly distorted corner

}  // namespace vergence
