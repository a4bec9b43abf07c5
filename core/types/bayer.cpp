#include "core/types/bayer.hpp"

#include <algorithm>
#include <array>
#include <cassert>

namespace vergence {
namespace {

// Number of columns per pass, so that a row of sums with one more at each end fits on the stack.
constexpr int kPiece = 1022;

/// Computes out[0, count) from sums[0, count + 2). Without branches and aliases the compiler
/// vectorises it, and down() as well.
void stereo(const std::uint16_t* __restrict sums, int count,
            std::uint8_t* __restrict out) noexcept {
  for (int i = 0; i < count; ++i)
    out[i] = static_cast<std::uint8_t>((sums[i] + 2 * sums[i + 1] + sums[i + 2] + 8) >> 4);
}

void down(const std::uint8_t* above, const std::uint8_t* here, const std::uint8_t* below, int count,
          std::uint16_t* __restrict sums) noexcept {
  for (int i = 0; i < count; ++i)
    sums[i] = static_cast<std::uint16_t>(above[i] + 2 * here[i] + below[i]);
}

}  // namespace

void bayer_to_grey(const std::uint8_t* raw, std::ptrdiff_t raw_stride, int width, int height,
                   std::uint8_t* out, std::ptrdiff_t out_stride) noexcept {
  assert(width >= 2 && height >= 2);
  // Sums of columns first − 1 … first + count.
  std::array<std::uint16_t, kPiece + 2> sums;
  for (int y = 0; y < height; ++y) {
    const std::uint8_t* here = raw + y * raw_stride;
    const std::uint8_t* above = raw + (y > 0 ? y - 1 : 1) * raw_stride;
    const std::uint8_t* below = raw + (y + 1 < height ? y + 1 : height - 2) * raw_stride;
    for (int first = 0; first < width; first += kPiece) {
      const int count = std::min(kPiece, width - first);
      const int from = std::max(0, first - 1), to = std::min(width, first + count + 1);
      std::uint16_t* const own = sums.data() + (from - (first - 1));
      down(above + from, here + from, below + from, to - from, own);
      if (first == 0) sums[0] = sums[2];
      if (first + count == width)
        sums[static_cast<std::size_t>(count) + 1] = sums[static_cast<std::size_t>(count) - 1];
      stereo(sums.data(), count, out + y * out_stride + first);
    }
  }
}

}  // namespace vergence
