#pragma once
#include <array>
#include <cstdint>

#include "core/features/patch.hpp"

namespace vergence::features {

/// 256 comparisons of smoothed grey values at fixed places of a patch (Calonder et al., "BRIEF",
/// ECCV 2010): for finding a point again after tracking was lost. Stands a turn of some 20° and a
/// change of size of some 20 %.
struct Descriptor {
  std::array<std::uint64_t, 4> bits{};
};

inline constexpr int kDescriptorLevel =
    1;  // of the pyramid: less noise, and a neighbourhood of 56 px

/// Computes the descriptor at the patch's level kDescriptorLevel, or at its coarsest level if it
/// has fewer.
[[nodiscard]] Descriptor describe(const Patch& patch) noexcept;

/// Bits that differ, 0 … 256; unrelated patches differ in 128 ± 8.
[[nodiscard]] int distance(const Descriptor& a, const Descriptor& b) noexcept;

}  // namespace vergence::features
