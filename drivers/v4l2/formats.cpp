#include "drivers/v4l2/formats.hpp"

#include <linux/videodev2.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cstring>

#include "core/types/bayer.hpp"

namespace vergence::v4l2 {
namespace {

constexpr std::array kFormats = {
    PixelFormat{V4L2_PIX_FMT_GREY, Layout::luma_plane},
    PixelFormat{V4L2_PIX_FMT_NV12, Layout::luma_plane},
    PixelFormat{V4L2_PIX_FMT_NV21, Layout::luma_plane},
    PixelFormat{V4L2_PIX_FMT_YUV420, Layout::luma_plane},
    PixelFormat{V4L2_PIX_FMT_YVU420, Layout::luma_plane},
    PixelFormat{V4L2_PIX_FMT_NV16, Layout::luma_plane},
    PixelFormat{V4L2_PIX_FMT_YUV422P, Layout::luma_plane},
    PixelFormat{V4L2_PIX_FMT_Y10P, Layout::packed10},
    PixelFormat{V4L2_PIX_FMT_Y10, Layout::words, 2},
    PixelFormat{V4L2_PIX_FMT_Y12, Layout::words, 4},
    PixelFormat{V4L2_PIX_FMT_Y14, Layout::words, 6},
    PixelFormat{V4L2_PIX_FMT_Y16, Layout::words, 8},
    PixelFormat{V4L2_PIX_FMT_YUYV, Layout::luma_first},
    PixelFormat{V4L2_PIX_FMT_YVYU, Layout::luma_first},
    PixelFormat{V4L2_PIX_FMT_UYVY, Layout::chroma_first},
    PixelFormat{V4L2_PIX_FMT_VYUY, Layout::chroma_first},
    PixelFormat{V4L2_PIX_FMT_SRGGB8, Layout::mosaic},
    PixelFormat{V4L2_PIX_FMT_SGRBG8, Layout::mosaic},
    PixelFormat{V4L2_PIX_FMT_SGBRG8, Layout::mosaic},
    PixelFormat{V4L2_PIX_FMT_SBGGR8, Layout::mosaic},
};

// One row each. The loops are plain so that the compiler makes vectors of them.

void unpack_words(const std::uint8_t* from, std::size_t width, int shift,
                  std::uint8_t* to) noexcept {
  for (std::size_t x = 0; x < width; ++x) {
    const unsigned word =
        static_cast<unsigned>(from[2 * x]) | static_cast<unsigned>(from[2 * x + 1]) << 8U;
    to[x] = static_cast<std::uint8_t>(std::min(word >> static_cast<unsigned>(shift), 255U));
  }
}

void unpack_packed10(const std::uint8_t* from, std::size_t width, std::uint8_t* to) noexcept {
  const std::size_t whole = width / 4;
  for (std::size_t i = 0; i < whole; ++i) std::memcpy(to + 4 * i, from + 5 * i, 4);
  std::memcpy(to + 4 * whole, from + 5 * whole, width % 4);
}

void unpack_every_other(const std::uint8_t* from, std::size_t width, std::uint8_t* to) noexcept {
  for (std::size_t x = 0; x < width; ++x) to[x] = from[2 * x];
}

}  // namespace

std::string name_of(std::uint32_t fourcc) {
  std::string name;
  for (unsigned i = 0; i < 4; ++i) {
    const auto c = static_cast<char>(fourcc >> (8 * i) & 0x7fU);
    name.push_back(c >= ' ' && c <= '~' ? c : '?');
  }
  name.erase(name.find_last_not_of(' ') + 1);
  return name;
}

const PixelFormat* choose_format(std::span<const std::uint32_t> offered,
                                 std::string_view requested) noexcept {
  for (const PixelFormat& format : kFormats) {
    if (std::find(offered.begin(), offered.end(), format.fourcc) == offered.end()) continue;
    if (requested.empty() || name_of(format.fourcc) == requested) return &format;
  }
  return nullptr;
}

std::size_t min_row_bytes(const PixelFormat& format, int width) noexcept {
  const auto w = static_cast<std::size_t>(width);
  switch (format.layout) {
    case Layout::luma_plane:
    case Layout::mosaic:
      return w;
    case Layout::packed10:
      return (w * 5 + 3) / 4;
    case Layout::words:
    case Layout::luma_first:
    case Layout::chroma_first:
      return 2 * w;
  }
  return 2 * w;
}

std::size_t min_frame_bytes(const PixelFormat& format, int width, int height,
                            std::size_t stride) noexcept {
  return stride * static_cast<std::size_t>(height - 1) + min_row_bytes(format, width);
}

void to_grey(const PixelFormat& format, const std::uint8_t* from, std::size_t from_stride,
             int width, int height, std::uint8_t* to, std::size_t to_stride) noexcept {
  assert(from_stride >= min_row_bytes(format, width) &&
         to_stride >= static_cast<std::size_t>(width));
  if (format.layout == Layout::mosaic) {
    bayer_to_grey(from, static_cast<std::ptrdiff_t>(from_stride), width, height, to,
                  static_cast<std::ptrdiff_t>(to_stride));
    return;
  }
  const auto w = static_cast<std::size_t>(width);
  for (int y = 0; y < height; ++y, from += from_stride, to += to_stride) {
    switch (format.layout) {
      case Layout::luma_plane:
      case Layout::mosaic:
        std::memcpy(to, from, w);
        break;
      case Layout::words:
        unpack_words(from, w, format.shift, to);
        break;
      case Layout::packed10:
        unpack_packed10(from, w, to);
        break;
      case Layout::luma_first:
        unpack_every_other(from, w, to);
        break;
      case Layout::chroma_first:
        unpack_every_other(from + 1, w, to);
        break;
    }
  }
}

}  // namespace vergence::v4l2
