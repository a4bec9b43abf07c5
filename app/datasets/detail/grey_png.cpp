#include "app/datasets/detail/grey_png.hpp"

#include <libdeflate.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <new>

#include "app/datasets/detail/png.hpp"

namespace vergence::app::detail {
namespace {

using Bytes = std::span<const std::uint8_t>;

/// IHDR: 8 bits, grey, deflate, the five filters, not interlaced.
bool is_plain_grey(Bytes png) noexcept {
  constexpr std::size_t kDepth = 24;
  constexpr std::uint8_t kPlain[] = {8, 0, 0, 0, 0};
  return png.size() >= kPngHead && std::memcmp(&png[kDepth], kPlain, sizeof kPlain) == 0;
}

/// The content of all IDAT chunks, one behind the other. → bytes written, fewer than the file has
std::size_t join_pixel_chunks(Bytes png, std::uint8_t* to) noexcept {
  std::size_t n = 0;
  PngChunk chunk;
  for (std::size_t at = kPngChunks; next_chunk(png, &at, &chunk) && !chunk.is("IEND");) {
    const Bytes content = chunk.type_and_content.subspan(4);
    if (!chunk.is("IDAT") || content.empty()) continue;
    std::memcpy(to + n, content.data(), content.size());
    n += content.size();
  }
  return n;
}

/// Selected without a branch: on a noisy image one in two would be predicted wrongly.
int paeth(int left, int above, int above_left) noexcept {
  const int to_left = std::abs(above - above_left), to_above = std::abs(left - above_left),
            to_both = std::abs(left + above - 2 * above_left);
  const int nearer = to_above < to_left ? above : left;
  const int distance = std::min(to_above, to_left);
  return to_both < distance ? above_left : nearer;
}

/// Undoes the filter of one row; `above` is the row before it, undone. → false: no such filter
bool unfilter(std::uint8_t filter, const std::uint8_t* from, const std::uint8_t* above,
              std::size_t n, std::uint8_t* to) noexcept {
  std::uint8_t left = 0, above_left = 0;
  switch (filter) {
    case 0:
      std::memcpy(to, from, n);
      return true;
    case 1:
      for (std::size_t i = 0; i < n; ++i) to[i] = left = static_cast<std::uint8_t>(from[i] + left);
      return true;
    case 2:
      for (std::size_t i = 0; i < n; ++i) to[i] = static_cast<std::uint8_t>(from[i] + above[i]);
      return true;
    case 3:
      for (std::size_t i = 0; i < n; ++i)
        to[i] = left = static_cast<std::uint8_t>(from[i] + (left + above[i]) / 2);
      return true;
    case 4:
      for (std::size_t i = 0; i < n; ++i) {
        to[i] = left = static_cast<std::uint8_t>(from[i] + paeth(left, above[i], above_left));
        above_left = above[i];
      }
      return true;
    default:
      return false;
  }
}

/// The content of the chunks, the filtered rows, and a row of nothing above the first.
std::size_t work_bytes(std::size_t file_bytes, ImageSize size) noexcept {
  const auto width = static_cast<std::size_t>(size.width),
             height = static_cast<std::size_t>(size.height);
  return file_bytes + (width + 1) * height + width;
}

}  // namespace

void GreyPngDecoder::Release::operator()(libdeflate_decompressor* d) const noexcept {
  libdeflate_free_decompressor(d);
}

GreyPngDecoder::GreyPngDecoder() : inflater_(libdeflate_alloc_decompressor()) {
  if (!inflater_) throw std::bad_alloc();
}

GreyPngDecoder::~GreyPngDecoder() = default;

void GreyPngDecoder::reserve(std::size_t file_bytes, ImageSize size) {
  const std::size_t bytes = work_bytes(file_bytes, size);
  if (bytes <= work_size_) return;
  work_ = std::make_unique_for_overwrite<std::uint8_t[]>(bytes);
  work_size_ = bytes;
}

bool GreyPngDecoder::decode(Bytes bytes, ImageSize size, std::uint8_t* out,
                            std::size_t stride) noexcept {
  if (!is_plain_grey(bytes) || work_bytes(bytes.size(), size) > work_size_) return false;
  const auto width = static_cast<std::size_t>(size.width),
             height = static_cast<std::size_t>(size.height);
  const std::size_t row = width + 1;  // its filter before it
  std::uint8_t *filtered = work_.get() + bytes.size(), *nothing = filtered + row * height;
  const std::size_t packed = join_pixel_chunks(bytes, work_.get());
  std::size_t read = 0;
  if (libdeflate_zlib_decompress_ex(inflater_.get(), work_.get(), packed, filtered, row * height,
                                    &read, nullptr) != LIBDEFLATE_SUCCESS)
    return false;
  std::memset(nothing, 0, width);
  const std::uint8_t* above = nothing;
  for (std::size_t y = 0; y < height; ++y) {
    const std::uint8_t* from = filtered + y * row;
    std::uint8_t* to = out + y * stride;
    if (!unfilter(from[0], from + 1, above, width, to)) return false;
    above = to;
  }
  return true;
}

bool decode_grey_png(Bytes bytes, ImageSize size, std::uint8_t* out, std::size_t stride) noexcept
    try {
  GreyPngDecoder decoder;
  decoder.reserve(bytes.size(), size);
  return decoder.decode(bytes, size, out, stride);
} catch (const std::bad_alloc&) {
  return false;
}

}  // namespace vergence::app::detail
