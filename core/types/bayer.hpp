#pragma once
#include <cstddef>
#include <cstdint>

namespace vergence {

/// Converts an 8-bit raw Bayer mosaic of any of the four patterns (RGGB, BGGR, GBRG, GRBG) to 8-bit
/// grey.
///
///   grey = (1 2 1)ᵀ (1 2 1) / 16 applied to the mosaic, rounded to the nearest, half up
///
/// Around every pixel these weights give red 1/4, green 1/2 and blue 1/4, the luminance of bilinear
/// demosaicing. A mosaic is luminance plus colour differences on carriers at half the sampling rate
/// across, along and both (Alleysson, Süsstrunk & Hérault 2005). The filter is zero at all three,
/// so no checkerboard pattern is left, and the phase of the pattern need not be known. The border
/// is mirrored about its outermost row and column, which keeps the phase.
/// Threads  Pure function. Memory: 2 KB of stack; no heap. Integers only: the same bytes on every
///          target.
/// Preconditions  width, height ≥ 2; strides ≥ width; `out` does not overlap `raw`.
void bayer_to_grey(const std::uint8_t* raw, std::ptrdiff_t raw_stride, int width, int height,
                   std::uint8_t* out, std::ptrdiff_t out_stride) noexcept;

}  // namespace vergence
