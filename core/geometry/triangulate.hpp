#pragma once
#include <cstdint>
#include <span>

#include "core/math/se3.hpp"

namespace vergence {

/// One view of a point: where the camera was and the undistorted ray (x, y, 1) it measured.
struct RayView {
  Transform T_camera_world{};
  Vec2 ray = Vec2::Zero();  // (X/Z, Y/Z)
  double sigma = 0;         // of one coordinate of `ray`: pixel sigma / focal length, > 0
};

enum class TriangulateStatus : std::uint8_t {
  ok,             // depth is significant
  no_parallax,    // depth is not significant: the direction holds, p_world stands at the nearest
                  // plausible depth
  behind,         // the rays meet behind a camera
  no_baseline,    // all cameras at one place, or the point on the line through them: nothing about
                  // depth
  invalid_input,  // fewer than two views, numbers that are none, sigma ≤ 0
};

struct TriangulateOptions {
  int max_steps = 5;            // Gauss–Newton; two or three are usual
  double min_significance = 3;  // inverse depth over its sigma from which on a depth is used
};

struct TriangulatedPoint {
  TriangulateStatus status = TriangulateStatus::invalid_input;
  Vec3 p_world = Vec3::Zero();  // m; ok and no_parallax only
  Mat3 covariance =
      Mat3::Zero();  // of p_world, m²; ok only (beyond it the distribution is no ellipsoid)
  double inverse_depth = 0;  // 1/Z in the first view, 1/m; not for invalid_input and no_baseline
  double inverse_depth_sigma = 0;  // 1/m
  double chi2 = 0;                 // Σ |e|²/σ² at the end; 2·views − 3 degrees of freedom
};

/// Point from two or more views: linear in the inverse depth, then Gauss–Newton on the reprojection
/// of all views.
///
/// Parameters (a, b, ρ): the point (a, b, 1)/ρ of the first view's frame; view i sees h = R_i (a,
/// b, 1) + ρ t_i, its ray is h_xy/h_z, which stays regular for a point at infinity (J. Montiel, J.
/// Civera, A. Davison, RSS 2006). Threads pure. Memory none. Errors by status; nothing that comes
/// out is NaN.
[[nodiscard]] TriangulatedPoint triangulate(std::span<const RayView> views,
                                            const TriangulateOptions& options) noexcept;

}  // namespace vergence
