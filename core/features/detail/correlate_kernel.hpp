#pragma once
#include <cstddef>
#include <cstdint>

namespace vergence::features::detail {

inline constexpr int kBlock = 8;  // px a side

struct BlockSums {
  std::int32_t product, sum, square;  // Σ T·I, Σ I, Σ I² over 8×8 px
};

/// Sums of an 8×8 template (rows packed) against the image at each of n places, a byte offset from
/// `image` each.
void correlate(const std::uint8_t* block, const std::uint8_t* image, std::ptrdiff_t stride,
               const std::int32_t* offsets, int n, BlockSums* sums) noexcept;

}  // namespace vergence::features::detail
