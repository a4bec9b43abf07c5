#pragma once
#include <cstddef>
#include <cstdint>

#include "firmware_iface/iidc/formats.hpp"

namespace vergence::iidc {

/// How an image as sent becomes 8-bit grey.
struct GreyConversion {
  ColorCoding coding = ColorCoding::mono8;
  bool mosaic = false;           // 8 bits behind a Bayer filter
  unsigned effective_bits = 16;  // of 16-bit pixels, in the low bits; 8 … 16
  /// Nothing to do: the transport's bytes are the image.
  [[nodiscard]] bool none() const noexcept {
    return !mosaic && (coding == ColorCoding::mono8 || coding == ColorCoding::raw8);
  }
  /// Whether there is a way at all.
  [[nodiscard]] bool possible() const noexcept;
};

/// Converts width × height pixels, rows of `stride` bytes in `out`.
///
/// Method  Mosaic: bayer_to_grey(). 16 bits: the eight highest of the effective ones. YUV: the
///         luma. RGB: 1:2:1.
/// Time    One pass. Memory: none beside the images.
/// Precondition  conversion.possible() and not none(); a mosaic has at least two rows and columns;
///               `in` holds frame_bytes(width, height,
/// coding).
void to_grey(const GreyConversion& conversion, const std::uint8_t* in, int width, int height,
             std::uint8_t* out, std::size_t stride) noexcept;

}  // namespace vergence::iidc
