#pragma once
#include "core/features/detail/surf_integral.hpp"
#include "core/features/surf.hpp"

namespace vergence::features::detail {

/// Direction of the strongest sum of gradients within a sector of 60°, in rad, −π … π, x towards y;
/// 0 without structure. Haar wavelets of side 4 s on a grid of s within 6 s of the point, weighted
/// by a Gaussian of 2 s.
[[nodiscard]] float surf_orientation(const IntegralImage& image, float x, float y,
                                     float scale) noexcept;

/// Descriptor of unit length: Σ dx, Σ dy, Σ |dx|, Σ |dy| over 4 × 4 parts of the square of 20 s
/// around the point, rotated by p.angle; 5 × 5 wavelets of side 2 s per part, weighted by a
/// Gaussian of 3.3 s. All zero without structure.
[[nodiscard]] SurfDescriptor surf_descriptor(const IntegralImage& image,
                                             const SurfPoint& p) noexcept;

}  // namespace vergence::features::detail
