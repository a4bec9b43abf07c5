#pragma once
#include <array>
#include <cstdint>

#include "core/features/patch.hpp"

namespace vergence::features {

/// BRIEF descriptor: 256 comparisons of smoothed grey values at fixed positions of a patch
/// (Calonder et al., ECCV 2010), to find a point again after tracking was lost. Tolerates rotations
/// of about 20° and scale changes of about 20 %.
struct Descriptor {
  std::array<std::uint64_t, 4> bits{};
};

/// Pyramid level of the descriptor, which has less noise and covers 56 px.
inline constexpr int kDescriptorLevel = 1;

/// Computes the descriptor at the patch's level kDescriptorLevel, or at its coarsest level if it
/// has fewer.
[[nodiscard]] Descriptor describe(const Patch& patch) noexcept;

/// Hamming distance, 0 … 256; that of unrelated patches is 128 ± 8.
[[nodiscard]] int distance(const Descriptor& a, const Descriptor& b) noexcept;

}  // namespace vergence::features
