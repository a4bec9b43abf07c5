#pragma once
#include "core/math/types.hpp"

namespace vergence::odometry {

/// Affine warp ∂(pixel there)/∂(pixel here) of a patch whose surface faces the camera it was cut
/// in. With X = T (z ray), moving the pixel moves the ray at constant depth z.
[[nodiscard]] inline Mat2 warp(const Mat23& d_pixel_d_point, const Mat3& R_there_here, double z,
                               const Mat2& d_ray_d_pixel) noexcept {
  return d_pixel_d_point * R_there_here.leftCols<2>() * (z * d_ray_d_pixel);
}

}  // namespace vergence::odometry
