#pragma once
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace vergence::gige {

/// Conversion of a pixel format to 8-bit grey.
struct GreyFormat {
  /// Name in the Pixel Format Naming Convention (PFNC).
  const char* name;
  enum class How : std::uint8_t { as_it_is, words, mosaic } how;
  /// For words, the number of low bits that are dropped.
  int shift = 0;
};

/// Returns the format called `requested`, or the cheapest one if that is empty. Null if none gives
/// grey.
[[nodiscard]] const GreyFormat* choose_format(const std::vector<std::string>& offered,
                                              std::string_view requested) noexcept;

/// Converts rows of `width` pixels without padding into rows of `stride` bytes.
///
/// Words are little endian; their eight highest bits are kept. Mosaics use bayer_to_grey().
/// Preconditions: width, height ≥ 2; `from` holds the whole image.
void to_grey(const GreyFormat& format, const std::uint8_t* from, int width, int height,
             std::uint8_t* to, std::size_t stride) noexcept;

}  // namespace vergence::gige
