#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace vergence::v4l2 {

/// Layout of the brightness in a buffer.
enum class Layout : std::uint8_t {
  /// 8 bits per pixel at the buffer's start, in rows of `bytesperline`; used without a copy.
  luma_plane,
  /// 16 bits per pixel, little endian, with the brightness in the low bits of the format's depth.
  words,
  /// Four pixels in five bytes: four high bytes, then the low bits.
  packed10,
  /// YUYV: brightness in the even bytes.
  luma_first,
  /// UYVY: brightness in the odd bytes.
  chroma_first,
  /// 8 bits behind a Bayer filter of any pattern.
  mosaic,
};

struct PixelFormat {
  std::uint32_t fourcc = 0;
  Layout layout = Layout::luma_plane;
  /// For words, the number of low bits that are dropped.
  int shift = 0;
};

/// The four characters without trailing blanks; unprintable ones become '?'.
[[nodiscard]] std::string name_of(std::uint32_t fourcc);

/// Returns the format called `requested`, or the cheapest to convert to grey if that is empty. Null
/// if none is offered.
[[nodiscard]] const PixelFormat* choose_format(std::span<const std::uint32_t> offered,
                                               std::string_view requested) noexcept;

/// Minimum size of a row of `width` pixels, in bytes.
[[nodiscard]] std::size_t min_row_bytes(const PixelFormat& format, int width) noexcept;
/// Minimum size of a complete frame, in bytes: the last row needs no padding.
[[nodiscard]] std::size_t min_frame_bytes(const PixelFormat& format, int width, int height,
                                          std::size_t stride) noexcept;

/// Converts to 8-bit brightness in rows of `to_stride` bytes. `shift` as in PixelFormat.
///
/// Mosaics use bayer_to_grey(). Reads min_frame_bytes() of `from` and writes `width` bytes of every
/// row. Preconditions: strides hold a row; 0 ≤ shift ≤ 8; a mosaic has at least two rows and
/// columns.
void to_grey(const PixelFormat& format, const std::uint8_t* from, std::size_t from_stride,
             int width, int height, std::uint8_t* to, std::size_t to_stride) noexcept;

}  // namespace vergence::v4l2
