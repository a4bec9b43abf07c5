#pragma once
#include <cstddef>
#include <span>
#include <vector>

#include "core/types/time.hpp"

namespace vergence::app::detail {

/// Indices of a longest strictly ascending part of the stamps: what stays when the fewest are left
/// out that go back or repeat one.
[[nodiscard]] std::vector<std::size_t> ascending(std::span<const Stamp> stamps);

}  // namespace vergence::app::detail
