#pragma once
#include <array>

#include "core/camera/camera.hpp"
#include "core/types/calibration.hpp"

namespace vergence::calibration::detail {

/// Number of grid points along each side of the image.
inline constexpr int kDepthGrid = 7;

/// A pixel of the left image, a depth, and the projection of that point into camera k.
struct CovisiblePoint {
  const Camera* left = nullptr;
  const Camera* right = nullptr;
  double depth_m = 0;
  Vec2 pixel = Vec2::Zero();
  /// Left ray (x, y, 1).
  Vec3 ray = Vec3::Zero();
  /// Point in the frame of camera k, in metres.
  Vec3 X = Vec3::Zero();
  /// Pixel in camera k's image.
  Vec2 at = Vec2::Zero();
  /// Derivative of `at` with respect to X, in px/m.
  Mat23 G = Mat23::Zero();
  /// Derivative of `at` with respect to the depth, in px/m.
  Vec2 by_depth = Vec2::Zero();
};

/// Calls each(place) for those points of a grid that both cameras see at a depth.
template <class Each>
void for_places(const RigCalibration& rig, int k, double depth_m, Each each) noexcept {
  const auto c = static_cast<std::size_t>(k);
  const Transform& T = rig.T_camera_left[c];
  const Camera left(rig.intrinsics[0]), right(rig.intrinsics[c]);
  for (int row = 0; row < kDepthGrid; ++row) {
    for (int column = 0; column < kDepthGrid; ++column) {
      CovisiblePoint p;
      p.left = &left;
      p.right = &right;
      p.depth_m = depth_m;
      p.pixel = {(column + 0.5) / kDepthGrid * rig.intrinsics[0].width,
                 (row + 0.5) / kDepthGrid * rig.intrinsics[0].height};
      if (!left.unproject(p.pixel, &p.ray)) continue;
      p.X = T * (p.ray * depth_m);
      if (right.project(p.X, &p.at, &p.G) != ProjectStatus::ok || !right.inside(p.at, 0.0))
        continue;
      p.by_depth = p.G * (T.R * p.ray);
      if (p.by_depth.squaredNorm() > 0) each(p);
    }
  }
}

/// Derivatives of a relative depth with respect to a rig's parameters, as rows of RigCovariance and
/// their factors.
struct DepthGradient {
  std::array<int, 6 + 2 * kIntrinsicsSize> row;
  std::array<double, 6 + 2 * kIntrinsicsSize> by;
  int count = 0;

  void add(int r, double value) noexcept {
    row[static_cast<std::size_t>(count)] = r;
    by[static_cast<std::size_t>(count++)] = value;
  }
};

/// `lenses`: includes the intrinsics, otherwise only the transform.
[[nodiscard]] DepthGradient depth_gradient(const CovisiblePoint& place,
                                           const Transform& T_camera_left, int k,
                                           bool lenses) noexcept;

/// Variance of the relative depth; without `joint` only by the transform's covariance_total or, if
/// that is zero, sigma_total.
[[nodiscard]] double depth_variance(const RigCalibration& rig, int k, const DepthGradient& g,
                                    bool joint) noexcept;

/// Computes the depths that a rig assigns to pairs of pixels.
class DepthReader {
 public:
  DepthReader(const RigCalibration& rig, int k) noexcept;
  /// Relative excess of the inverse depth that this rig gives to the place's two pixels. Returns
  /// false if they are outside its lens models.
  [[nodiscard]] bool difference(const CovisiblePoint& place, double* relative) const noexcept;

 private:
  Camera left_, right_;
  Transform T_;
};

}  // namespace vergence::calibration::detail
