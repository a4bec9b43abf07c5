#pragma once
#include "core/features/detail/surf_integral.hpp"
#include "core/features/surf.hpp"

namespace vergence::features::detail {

/// Descriptor of unit length: Σ dx, Σ dy, Σ |dx|, Σ |dy| over 4 × 4 parts of the square of 20 s
/// around the point; 5 × 5 wavelets of side 2 s per part, weighted by a
/// Gaussian of 3.3 s. All zero without structure.
[[nodiscard]] SurfDescriptor surf_descriptor(const IntegralImage& image,
                                             const SurfPoint& p) noexcept;

}  // namespace vergence::features::detail
