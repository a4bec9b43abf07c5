#pragma once
#include <algorithm>
#include <array>
#include <bit>

#include "app/datasets/image_file.hpp"

/// Kinds of image files. Files are untrusted: sizes are checked before decoding, and every offset
/// against the available bytes.
namespace vergence::app::detail {

using ImageBytes = std::span<const std::uint8_t>;

/// Upper 8 of the lower `bits` (8 to 16) of a grey sample; larger values are white.
[[nodiscard]] inline std::uint8_t narrowed(std::uint16_t sample, int bits) noexcept {
  return static_cast<std::uint8_t>(std::min(sample >> static_cast<unsigned>(bits - 8), 255));
}

/// Luminance of ITU-R BT.601 in 8 bits, as in JPEG.
[[nodiscard]] inline std::uint8_t luminance(unsigned red, unsigned green, unsigned blue) noexcept {
  return static_cast<std::uint8_t>((77U * red + 150U * green + 29U * blue + 128U) >> 8U);
}

/// Checks a file's claimed width and height before allocation. → ok, not_an_image (empty, or more
/// than any camera gives)
[[nodiscard]] inline ImageFileStatus accept_size(std::uint32_t width, std::uint32_t height,
                                                 ImageSize* size) noexcept {
  // In px.
  constexpr std::uint32_t kMaxSide = 1U << 15;
  // Limits what a file of a hundred bytes can make a reader allocate.
  constexpr std::uint64_t kMaxPixels = std::uint64_t{1} << 27;
  if (width == 0 || height == 0 || width > kMaxSide || height > kMaxSide ||
      std::uint64_t{width} * height > kMaxPixels)
    return ImageFileStatus::not_an_image;
  *size = {static_cast<int>(width), static_cast<int>(height)};
  return ImageFileStatus::ok;
}

/// Whole number of `count` bytes.
[[nodiscard]] inline std::uint32_t whole_at(ImageBytes bytes, std::size_t at, std::size_t count,
                                            std::endian order) noexcept {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < count; ++i)
    value = value << 8U | bytes[at + (order == std::endian::big ? i : count - 1 - i)];
  return value;
}

/// Kind of image files. size() requires that a file begins like this, decode() that size() is ok;
/// none throws.
///
/// begins  First bytes of the kind.
/// size    Reads the size from the first `head` bytes. → ok, truncated, not_an_image
/// decode  Writes rows of `stride` bytes, colours as 0.299 R + 0.587 G + 0.114 B (or the file's own
///         luminance). Grey samples of 16 bits are narrowed() from `deep_bits`; colours keep their
///         upper 8 bits. → ok, truncated (incomplete or damaged), undecodable
struct ImageKind {
  std::size_t head;
  std::array<std::string_view, 2> begins;
  ImageFileStatus (*size)(ImageBytes, ImageSize*) noexcept;
  ImageFileStatus (*decode)(ImageBytes, ImageSize, std::uint8_t* out, std::size_t stride,
                            int deep_bits) noexcept;
};
/// PNG of every kind by libpng; JPEG of 8-bit grey or three colours by libjpeg-turbo; uncompressed
/// BMP of 8, 24 and 32 bits; PGM and PPM of bytes (P5, P6).
extern const ImageKind kPng, kJpeg, kBmp, kNetpbm;

/// In bytes: a JPEG's size follows its metadata of up to four segments of 64 KiB.
inline constexpr std::size_t kJpegHead = std::size_t{256} << 10U;

}  // namespace vergence::app::detail
