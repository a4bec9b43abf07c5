#include "drivers/iidc/grey.hpp"

#include <algorithm>

#include "core/types/bayer.hpp"

namespace vergence::iidc {

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

void to_grey(const GreyConversion& conversion, const std::uint8_t* in, int width, int height,
             std::uint8_t* out, std::size_t stride) noexcept {
  if (conversion.mosaic) {
    bayer_to_grey(in, width, width, height, out, static_cast<std::ptrdiff_t>(stride));
    return;
  }
  const std::size_t in_stride = frame_bytes(static_cast<unsigned>(width), 1, conversion.coding);
  for (int y = 0; y < height; ++y) {
    const std::uint8_t* row = in + static_cast<std::size_t>(y) * in_stride;
    std::uint8_t* to = out + static_cast<std::size_t>(y) * stride;
    switch (conversion.coding) {
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
        for (int x = 0; x < width; ++x)
          to[x] = row[x / 4 * 6 + (x % 4 < 2 ? 1 + x % 4 : 2 + x % 4)];
        break;
      case ColorCoding::yuv444:  // U Y V
        for (int x = 0; x < width; ++x) to[x] = row[3 * x + 1];
        break;
      case ColorCoding::rgb8:
        for (int x = 0; x < width; ++x)
          to[x] = static_cast<std::uint8_t>(
              (static_cast<unsigned>(row[3 * x]) + 2U * row[3 * x + 1] + row[3 * x + 2] + 2) / 4);
        break;
      default:
        return;
    }
  }
}

}  // namespace vergence::iidc
