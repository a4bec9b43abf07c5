#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

#include "app/datasets/image_file.hpp"

/// PNG by libpng. Files are untrusted: chunks are walked with their check sums and the size is
/// accepted before libpng sees a byte.
namespace vergence::app::detail {

inline constexpr std::size_t kPngHead = 33;  // bytes of the signature and the whole IHDR chunk

[[nodiscard]] bool is_png(std::span<const std::uint8_t> bytes) noexcept;
/// So few bytes that they may be the beginning of a PNG, or nothing at all.
[[nodiscard]] bool may_become_png(std::span<const std::uint8_t> bytes) noexcept;

/// From the head alone. Precondition: is_png(). → ok, torn, not_an_image
[[nodiscard]] ImageFileStatus png_size(std::span<const std::uint8_t> bytes,
                                       ImageSize* size) noexcept;

/// Every chunk with its check sum, up to IEND; what follows it is nobody's business. Precondition:
/// is_png(). → ok, torn
[[nodiscard]] ImageFileStatus check_png(std::span<const std::uint8_t> bytes) noexcept;

/// The upper 8 of the lower `bits` (8 … 16) of a grey sample; what is beyond them is white.
[[nodiscard]] inline std::uint8_t narrowed(std::uint16_t sample, int bits) noexcept {
  return static_cast<std::uint8_t>(std::min(sample >> static_cast<unsigned>(bits - 8), 255));
}

/// What is done with grey samples of 16 bits; of colours the upper 8 are taken.
struct DeepSamples {
  int bits = 16;           // as narrowed()'s
  std::uint16_t peak = 0;  // set: the greatest sample; 0 where the file has other samples
};

/// Rows of `stride` bytes: 8 of 16 bits as `deep` says, palettes and colours as 0.299 R + 0.587 G +
/// 0.114 B, alpha dropped.
/// Precondition: check_png() and the size are right. Throws nothing. → ok, undecodable
[[nodiscard]] ImageFileStatus decode_png(std::span<const std::uint8_t> bytes, ImageSize size,
                                         std::uint8_t* out, std::size_t stride,
                                         DeepSamples* deep) noexcept;

}  // namespace vergence::app::detail
