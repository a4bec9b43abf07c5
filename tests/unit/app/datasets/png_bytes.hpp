#pragma once
#include <zlib.h>

#include <cstdint>
#include <string_view>
#include <vector>

/// PNG files chunk by chunk, also such as no encoder writes.
namespace vergence::test {

using FileBytes = std::vector<std::uint8_t>;

inline void append_u32(FileBytes* to, std::uint32_t v) {
  for (const unsigned shift : {24U, 16U, 8U, 0U})
    to->push_back(static_cast<std::uint8_t>(v >> shift));
}

inline void append_chunk(FileBytes* png, std::string_view type, const FileBytes& data) {
  append_u32(png, static_cast<std::uint32_t>(data.size()));
  const std::size_t at = png->size();
  png->insert(png->end(), type.begin(), type.end());
  png->insert(png->end(), data.begin(), data.end());
  append_u32(png, static_cast<std::uint32_t>(
                      crc32(0, png->data() + at, static_cast<uInt>(data.size() + 4))));
}

inline FileBytes deflated(const FileBytes& raw) {
  uLongf size = compressBound(raw.size());
  FileBytes packed(size);
  (void)compress2(packed.data(), &size, raw.data(), raw.size(), 6);
  packed.resize(size);
  return packed;
}

/// What a PNG is before its pixels. `colours` as in IHDR: 0 grey, 2 RGB, 3 palette, 4 grey and
/// alpha, 6 RGBA.
struct PngKind {
  int colours = 0, depth = 8;
  bool interlaced = false;
};

inline FileBytes png_head(const PngKind& kind, int width, int height) {
  FileBytes png{0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'}, head;
  append_u32(&head, static_cast<std::uint32_t>(width));
  append_u32(&head, static_cast<std::uint32_t>(height));
  for (const int v : {kind.depth, kind.colours, 0, 0, kind.interlaced ? 1 : 0})
    head.push_back(static_cast<std::uint8_t>(v));
  append_chunk(&png, "IHDR", head);
  return png;
}

/// Bytes of all rows with their filter bytes, of all seven passes where it is interlaced.
inline std::vector<std::size_t> png_row_sizes(const PngKind& kind, int width, int height) {
  const int samples = kind.colours == 2 ? 3 : kind.colours == 4 ? 2 : kind.colours == 6 ? 4 : 1;
  constexpr int kPasses[7][4] = {{0, 0, 8, 8}, {4, 0, 8, 8}, {0, 4, 4, 8}, {2, 0, 4, 4},
                                 {0, 2, 2, 4}, {1, 0, 2, 2}, {0, 1, 1, 2}};
  constexpr int kWhole[4] = {0, 0, 1, 1};
  std::vector<std::size_t> rows;
  for (int pass = 0; pass < (kind.interlaced ? 7 : 1); ++pass) {
    const auto& p = kind.interlaced ? kPasses[pass] : kWhole;
    const int columns = (width - p[0] + p[2] - 1) / p[2], lines = (height - p[1] + p[3] - 1) / p[3];
    if (columns <= 0) continue;
    for (int y = 0; y < lines; ++y)
      rows.push_back(1 + static_cast<std::size_t>((columns * samples * kind.depth + 7) / 8));
  }
  return rows;
}

/// Pixels of noise; every row with the next of the five filters.
inline FileBytes png_noise(const PngKind& kind, int width, int height) {
  FileBytes raw;
  std::uint32_t noise = 12345;
  int filter = 0;
  for (const std::size_t size : png_row_sizes(kind, width, height)) {
    raw.push_back(static_cast<std::uint8_t>(filter++ % 5));
    for (std::size_t i = 1; i < size; ++i) {
      noise = noise * 1664525U + 1013904223U;
      raw.push_back(static_cast<std::uint8_t>(noise >> 24U));
    }
  }
  return raw;
}

}  // namespace vergence::test
