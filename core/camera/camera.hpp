#pragma once
#include "core/types/calibration.hpp"

namespace vergence {

enum class ProjectStatus : std::uint8_t {
  ok,
  /// The depth is below kMinDepth, or NaN.
  behind,
  /// The angle is outside the monotonic range of the distortion model, or x or y is NaN.
  folded,
};

/// Minimum depth in metres, nearer than any lens.
inline constexpr double kMinDepth = 1e-3;

/// Projection of one camera with derivatives; a small value with fixed memory.
///
/// With (x, y) = (X, Y)/Z and r² = x² + y² the pixel is (fx x_d + cx, fy y_d + cy), where
///
///     radtan       x_d = x (1 + k1 r² + k2 r⁴ + k3 r⁶) + 2 p1 x y + p2 (r² + 2x²), likewise y_d
///     equidistant  (x_d, y_d) = (x, y) θ_d / r with θ = atan r and
///                  θ_d = θ (1 + k1 θ² + k2 θ⁴ + k3 θ⁶ + k4 θ⁸)
///
///     const Camera camera(intrinsics);
///     Vec2 pixel;
///     Mat23 d_pixel_d_point;
///     if (camera.project({1, -0.5, 8}, &pixel, &d_pixel_d_point) != ProjectStatus::ok) return;
///     Vec3 ray;
///     if (!camera.unproject(pixel, &ray)) return;  // 8 * ray is the point
///
/// Threads    Const after construction.
class Camera {
 public:
  Camera() noexcept = default;
  explicit Camera(const Intrinsics& k) noexcept;

  /// Projects a point in the camera's frame, in m, to a pixel. J (2×3, may be null): ∂pixel/∂p,
  /// including distortion. If the result is not `ok`, pixel and J are unchanged.
  [[nodiscard]] ProjectStatus project(const Vec3& p, Vec2* pixel, Mat23* J) const noexcept;

  /// Converts a pixel to the undistorted ray (x, y, 1) by Newton's method from the distorted point,
  /// in at most kUnprojectSteps steps. Returns false and leaves *ray unchanged if it does not
  /// converge or leaves the model's monotonic range.
  [[nodiscard]] bool unproject(const Vec2& pixel, Vec3* ray) const noexcept;

  /// ∂pixel/∂(fx, fy, cx, cy, d0 … d4) at p. Precondition: project(p) is ok.
  [[nodiscard]] Eigen::Matrix<double, 2, 9> intrinsics_jacobian(const Vec3& p) const noexcept;

  [[nodiscard]] const Intrinsics& intrinsics() const noexcept { return k_; }
  /// Squared radius of (x, y) up to which the distortion is monotonic.
  [[nodiscard]] double max_radius2() const noexcept { return max_radius2_; }
  /// True if the pixel is inside the image with a border of `margin` px.
  [[nodiscard]] bool inside(const Vec2& pixel, double margin) const noexcept {
    return pixel.x() >= margin && pixel.y() >= margin && pixel.x() <= k_.width - 1 - margin &&
           pixel.y() <= k_.height - 1 - margin;
  }

 private:
  /// Distorts a normalised point. J: ∂distorted/∂undistorted.
  [[nodiscard]] bool distort(const Vec2& n, Vec2* d, Mat2* J) const noexcept;

  Intrinsics k_{};
  bool distorted_ = false;
  double max_radius2_ = 0;
};

// Maximum number of Newton steps; strongly distorted corners take 4 to 6.
inline constexpr int kUnprojectSteps = 12;

}  // namespace vergence
