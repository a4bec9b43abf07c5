#include "drivers/iidc/grey.hpp"

#include <algorithm>

namespace vergence::iidc {
namespace {

/// (left + 2 middle + right) of one row at x, the border mirrored, which keeps the pattern's phase.
unsigned row_sum(const std::uint8_t* row, int x, int width) noexcept {
  const int left = x > 0 ? x - 1 : std::min(1, width - 1), right = x + 1 < width ? x + 1 : std::max(width - 2, 0);
  return static_cast<unsigned>(row[left]) + 2U * row[x] + row[right];
}

void mosaic_row(const std::uint8_t* above, const std::uint8_t* row, const std::uint8_t* below, int width, std::uint8_t* out) noexcept {
  const auto at = [&](int x) {
    out[x] = static_cast<std::uint8_t>((row_sum(above, x, width) + 2 * row_sum(row, x, width) + row_sum(below, x, width) + 8) / 16);
  };
  at(0);
  for (int x = 1; x + 1 < width; ++x) {  // no branches: the compiler makes vectors of it
    const unsigned a = static_cast<unsigned>(above[x - 1]) + 2U * above[x] + above[x + 1];
    const unsigned r = static_cast<unsigned>(row[x - 1]) + 2U * row[x] + row[x + 1];
    const unsigned b = static_cast<unsigned>(below[x - 1]) + 2U * below[x] + below[x + 1];
    out[x] = static_cast<std::uint8_t>((a + 2 * r + b + 8) / 16);
  }
  if (width > 1) at(width - 1);
}

}  // namespace

bool GreyConversion::possible() const noexcept {
  switch (coding) {
    case ColorCoding::mono8:
    case ColorCoding::raw8:
      return true;
    case ColorCoding::mono16:
    case ColorCoding::raw16:
      return !mosaic && effective_bits >= 8 && effective_bits <= 16;
    case ColorCoding::yuv411:
    case ColorCoding::yuv422:
    case ColorCoding::yuv444:
    case ColorCoding::rgb8:
      return !mosaic;
    default:
      return false;
  }
}

void to_grey(const GreyConversion& conversion, const std::uint8_t* in, int width, int height, std::uint8_t* out,
             std::size_t stride) noexcept {
  const std::size_t in_stride = frame_bytes(static_cast<unsigned>(width), 1, conversion.coding);
  for (int y = 0; y < height; ++y) {
    const std::uint8_t* row = in + static_cast<std::size_t>(y) * in_stride;
    std::uint8_t* to = out + static_cast<std::size_t>(y) * stride;
    switch (conversion.coding) {
      case ColorCoding::mono8:
      case ColorCoding::raw8: {
        const std::uint8_t* above = y > 0 ? row - in_stride : in + (height > 1 ? in_stride : 0);
        const std::uint8_t* below = y + 1 < height ? row + in_stride : (height > 1 ? row - in_stride : row);
        mosaic_row(above, row, below, width, to);
        break;
      }
      case ColorCoding::mono16:
      case ColorCoding::raw16:
        for (int x = 0; x < width; ++x) {
          const unsigned v = static_cast<unsigned>(row[2 * x]) << 8U | row[2 * x + 1];
          to[x] = static_cast<std::uint8_t>(std::min(255U, v >> (conversion.effective_bits - 8)));
        }
        break;
      case ColorCoding::yuv422:  // U Y V Y
        for (int x = 0; x < width; ++x) to[x] = row[2 * x + 1];
        break;
      case ColorCoding::yuv411:  // U Y Y V Y Y
        for (int x = 0; x < width; ++x) to[x] = row[x / 4 * 6 + (x % 4 < 2 ? 1 + x % 4 : 2 + x % 4)];
        break;
      case ColorCoding::yuv444:  // U Y V
        for (int x = 0; x < width; ++x) to[x] = row[3 * x + 1];
        break;
      case ColorCoding::rgb8:
        for (int x = 0; x < width; ++x)
          to[x] = static_cast<std::uint8_t>((static_cast<unsigned>(row[3 * x]) + 2U * row[3 * x + 1] + row[3 * x + 2] + 2) / 4);
        break;
      default:
        return;
    }
  }
}

}  // namespace vergence::iidc
