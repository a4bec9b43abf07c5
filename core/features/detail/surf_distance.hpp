#pragma once
#include "core/features/surf.hpp"

namespace vergence::features::detail {

[[nodiscard]] float squared_distance(const SurfDescriptor& a, const SurfDescriptor& b) noexcept;

}  // namespace vergence::features::detail
