#pragma once
#include <cstddef>
#include <cstdint>

namespace vergence::features::detail {

/// Side of the template, in px.
inline constexpr int kBlock = 8;
/// Number of positions that correlate() processes at a time.
inline constexpr int kPlacesAtATime = 32;

/// An 8×8 template with its sums.
struct Block {
  std::uint8_t pixels[kBlock * kBlock];
  /// Σ T and 64 Σ T² − (Σ T)².
  float sum = 0, variance = 0;
};

/// Squared normalised correlation of the template with the image at each of n positions, given as
/// byte offsets from `image`; 0 if the correlation is negative or the image has no contrast.
/// `scores` has room for n rounded up to a multiple of kPlacesAtATime. Equal on every target.
void correlate(const Block& block, const std::uint8_t* image, std::ptrdiff_t stride,
               const std::int32_t* offsets, int n, float* scores) noexcept;

/// The highest of n scores, 0 without any.
[[nodiscard]] float highest(const float* scores, int n) noexcept;

}  // namespace vergence::features::detail
