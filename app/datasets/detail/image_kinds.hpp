#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

#include "app/datasets/image_file.hpp"

/// The kinds of image files that are read. Files are untrusted: sizes are accepted before a decoder
/// sees a byte, and every offset is checked against the bytes there are.
namespace vergence::app::detail {

using ImageBytes = std::span<const std::uint8_t>;

/// Reduces grey samples of 16 bits to 8; colours keep their upper 8 bits.
struct DeepSamples {
  int bits = 16;           // as narrowed()'s
  std::uint16_t peak = 0;  // set: the greatest sample; 0 where the file has other samples
};

/// The upper 8 of the lower `bits` (8 … 16) of a grey sample; what is beyond them is white.
[[nodiscard]] inline std::uint8_t narrowed(std::uint16_t sample, int bits) noexcept {
  return static_cast<std::uint8_t>(std::min(sample >> static_cast<unsigned>(bits - 8), 255));
}

/// Luminance of ITU-R BT.601 in 8 bits, as JPEG has it.
[[nodiscard]] inline std::uint8_t luminance(unsigned red, unsigned green, unsigned blue) noexcept {
  return static_cast<std::uint8_t>((77U * red + 150U * green + 29U * blue + 128U) >> 8U);
}

/// A width and a height as a file claims them, before anything is taken for them. → ok,
/// not_an_image: nothing at all, or more than any camera gives
[[nodiscard]] inline ImageFileStatus accept_size(std::uint32_t width, std::uint32_t height,
                                                 ImageSize* size) noexcept {
  constexpr std::uint32_t kMaxSide = 1U << 15;  // px
  constexpr std::uint64_t kMaxPixels =
      std::uint64_t{1} << 27;  // what a file of a hundred bytes may make a reader take
  if (width == 0 || height == 0 || width > kMaxSide || height > kMaxSide ||
      std::uint64_t{width} * height > kMaxPixels)
    return ImageFileStatus::not_an_image;
  *size = {static_cast<int>(width), static_cast<int>(height)};
  return ImageFileStatus::ok;
}

/// One kind. Each function but the first has those before it as preconditions; none throws.
///
/// is      By the first bytes.
/// size    From the head alone, `head` bytes. → ok, torn, not_an_image
/// check   Whether all of it is there (image_file.hpp). → ok, torn, not_an_image
/// deep    It is of grey samples of 16 bits.
/// decode  Rows of `stride` bytes, colours as 0.299 R + 0.587 G + 0.114 B (or the file's own
///         luminance), 8 of 16 bits as the samples say. → ok, torn (damaged inside), undecodable
struct ImageKind {
  std::size_t head;
  bool (*is)(ImageBytes) noexcept;
  ImageFileStatus (*size)(ImageBytes, ImageSize*) noexcept;
  ImageFileStatus (*check)(ImageBytes) noexcept;
  bool (*deep)(ImageBytes) noexcept;
  ImageFileStatus (*decode)(ImageBytes, ImageSize, std::uint8_t* out, std::size_t stride,
                            DeepSamples*) noexcept;
};
/// PNG of every kind by libpng; JPEG of 8-bit grey or three colours by libjpeg-turbo; uncompressed
/// BMP of 8, 24 and 32 bits; PGM and PPM of bytes (P5, P6).
extern const ImageKind kPng, kJpeg, kBmp, kNetpbm;

/// A JPEG's size stands behind its metadata: four segments of 64 KiB.
inline constexpr std::size_t kJpegHead = std::size_t{256} << 10U;  // bytes

/// So few bytes that they may be the beginning of a PNG, or nothing at all.
[[nodiscard]] bool may_become_png(ImageBytes bytes) noexcept;

}  // namespace vergence::app::detail
