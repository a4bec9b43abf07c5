#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace vergence::v4l2 {

/// Layout of the brightness in a buffer.
enum class Layout : std::uint8_t {
  luma_plane,  // 8 bits a pixel, rows of `bytesperline`, at the buffer's start: used where it lies
  words,       // 16 bits a pixel, little endian, brightness in the low bits of the format's depth
  packed10,    // four pixels in five bytes: four high bytes, then the low bits
  luma_first,  // YUYV: brightness in the even bytes
  chroma_first,  // UYVY: in the odd ones
  mosaic,        // 8 bits behind a Bayer filter of any pattern
};

struct PixelFormat {
  std::uint32_t fourcc = 0;
  Layout layout = Layout::luma_plane;
  int shift = 0;  // words: bits below the eight that are kept
};

/// All formats the driver turns into grey, the cheapest first.
[[nodiscard]] std::span<const PixelFormat> known_formats() noexcept;
/// The four characters, trailing blanks cut; unprintable ones become '?'.
[[nodiscard]] std::string name_of(std::uint32_t fourcc);

/// Returns the format called `requested`, or if that is empty the first of
/// known_formats(). Null: none.
[[nodiscard]] const PixelFormat* choose_format(std::span<const std::uint32_t> offered,
                                               std::string_view requested) noexcept;

/// Bytes a row of `width` pixels takes at least.
[[nodiscard]] std::size_t min_row_bytes(const PixelFormat& format, int width) noexcept;
/// Bytes that must have come for every row to be there: the last row needs no padding.
[[nodiscard]] std::size_t min_frame_bytes(const PixelFormat& format, int width, int height,
                                          std::size_t stride) noexcept;

/// Brightness, 8 bits, into rows of `to_stride` bytes. `shift` as in PixelFormat.
///
/// Method  Mosaics: bayer_to_grey(). Memory: reads min_frame_bytes() of `from`, writes `width`
///         bytes of every row. Preconditions: strides
/// hold a row; 0 ≤ shift ≤ 8; a mosaic has at least two rows and columns.
void to_grey(const PixelFormat& format, const std::uint8_t* from, std::size_t from_stride,
             int width, int height, std::uint8_t* to, std::size_t to_stride) noexcept;

}  // namespace vergence::v4l2
