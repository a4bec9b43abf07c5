#include "drivers/gige/detail/grey.hpp"

#include <algorithm>
#include <array>

#include "core/types/bayer.hpp"

namespace vergence::gige {
namespace {

constexpr std::array kFormats{
    GreyFormat{"Mono8", GreyFormat::How::as_it_is},
    GreyFormat{"BayerGB8", GreyFormat::How::mosaic},
    GreyFormat{"BayerGR8", GreyFormat::How::mosaic},
    GreyFormat{"BayerRG8", GreyFormat::How::mosaic},
    GreyFormat{"BayerBG8", GreyFormat::How::mosaic},
    GreyFormat{"Mono10", GreyFormat::How::words, 2},
    GreyFormat{"Mono12", GreyFormat::How::words, 4},
    GreyFormat{"Mono14", GreyFormat::How::words, 6},
    GreyFormat{"Mono16", GreyFormat::How::words, 8},
};

}  // namespace

const GreyFormat* choose_format(const std::vector<std::string>& offered,
                                std::string_view requested) noexcept {
  for (const GreyFormat& f : kFormats)
    if ((requested.empty() || requested == f.name) &&
        std::find(offered.begin(), offered.end(), f.name) != offered.end())
      return &f;
  return nullptr;
}

void to_grey(const GreyFormat& format, const std::uint8_t* from, int width, int height,
             std::uint8_t* to, std::size_t stride) noexcept {
  if (format.how == GreyFormat::How::mosaic) {
    bayer_to_grey(from, width, width, height, to, static_cast<std::ptrdiff_t>(stride));
    return;
  }
  const auto w = static_cast<std::size_t>(width);
  for (int y = 0; y < height; ++y) {
    std::uint8_t* row = to + static_cast<std::size_t>(y) * stride;
    if (format.how == GreyFormat::How::as_it_is) {
      std::copy_n(from + static_cast<std::size_t>(y) * w, w, row);
      continue;
    }
    const std::uint8_t* p = from + static_cast<std::size_t>(y) * w * 2;
    for (std::size_t x = 0; x < w; ++x)
      row[x] = static_cast<std::uint8_t>((p[2 * x] | p[2 * x + 1] << 8) >> format.shift);
  }
}

}  // namespace vergence::gige
