#pragma once
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace vergence::gige {

/// Conversion of a pixel format to 8-bit grey.
struct GreyFormat {
  const char* name;  // of the standard's pixel format naming convention
  enum class How : std::uint8_t { as_it_is, words, mosaic } how;
  int shift = 0;  // words: bits below the eight that are kept
};

/// Returns the format called `requested`, or the cheapest if that is empty.
/// Null: none that gives grey.
[[nodiscard]] const GreyFormat* choose_format(const std::vector<std::string>& offered,
                                              std::string_view requested) noexcept;

/// Rows of `width` pixels without padding into rows of `stride` bytes.
///
/// Words, little endian: the eight highest of the format's bits. Mosaic: bayer_to_grey().
/// Preconditions: width, height ≥ 2; `from` holds the image.
void to_grey(const GreyFormat& format, const std::uint8_t* from, int width, int height,
             std::uint8_t* to, std::size_t stride) noexcept;

}  // namespace vergence::gige
