#pragma once
#include <cstdint>
#include <span>

#include "core/math/se3.hpp"

namespace vergence {

/// One view of a point: the camera's pose and the undistorted ray (x, y, 1) it measured.
struct RayView {
  Transform T_camera_world{};
  /// (X/Z, Y/Z).
  Vec2 ray = Vec2::Zero();
  /// Standard deviation of one coordinate of `ray`: pixel sigma / focal length, > 0.
  double sigma = 0;
};

enum class TriangulateStatus : std::uint8_t {
  /// The depth is significant.
  ok,
  /// The depth is not significant; p_world is in the right direction at the nearest plausible
  /// depth.
  no_parallax,
  /// The rays meet behind a camera.
  behind,
  /// The cameras are at one place, or the point is on the line through them, so there is no depth.
  no_baseline,
  /// There are fewer than two views, values that are not finite, or sigma ≤ 0.
  invalid_input,
};

struct TriangulatedPoint {
  TriangulateStatus status = TriangulateStatus::invalid_input;
  /// Position in metres, for ok and no_parallax only.
  Vec3 p_world = Vec3::Zero();
  /// 1/Z in the first view, in 1/m; not for invalid_input and no_baseline.
  double inverse_depth = 0;
  double inverse_depth_sigma = 0;
};

/// Triangulates a point from two or more views: linear in the inverse depth, then Gauss–Newton on
/// the reprojection of all views.
///
/// Parameters (a, b, ρ): the point (a, b, 1)/ρ of the first view's frame; view i sees h = R_i (a,
/// b, 1) + ρ t_i, its ray is h_xy/h_z, which stays regular for a point at infinity (J. Montiel, J.
/// Civera, A. Davison, RSS 2006). Pure. Errors by status; results are never NaN.
[[nodiscard]] TriangulatedPoint triangulate(std::span<const RayView> views) noexcept;

}  // namespace vergence
