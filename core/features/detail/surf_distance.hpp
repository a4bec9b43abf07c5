#pragma once
#include "core/features/surf.hpp"

namespace vergence::features::detail {

/// Squared Euclidean distance of two descriptors.
[[nodiscard]] float squared_distance(const SurfDescriptor& a, const SurfDescriptor& b) noexcept;

}  // namespace vergence::features::detail
