#include "drivers/gige/detail/grey.hpp"

#include <algorithm>
#include <array>

namespace vergence::gige {
namespace {

constexpr std::array kFormats{
    GreyFormat{"Mono8", GreyFormat::How::as_it_is},  GreyFormat{"BayerGB8", GreyFormat::How::mosaic},
    GreyFormat{"BayerGR8", GreyFormat::How::mosaic}, GreyFormat{"BayerRG8", GreyFormat::How::mosaic},
    GreyFormat{"BayerBG8", GreyFormat::How::mosaic}, GreyFormat{"Mono10", GreyFormat::How::words, 2},
    GreyFormat{"Mono12", GreyFormat::How::words, 4}, GreyFormat{"Mono14", GreyFormat::How::words, 6},
    GreyFormat{"Mono16", GreyFormat::How::words, 8},
};

void mosaic_row(const std::uint8_t* above, const std::uint8_t* here, const std::uint8_t* below, int width, std::uint8_t* to) noexcept {
  const auto column = [&](int x) { return above[x] + 2 * here[x] + below[x]; };
  int left = column(1), middle = column(0);
  for (int x = 0; x < width; ++x) {
    const int right = column(x + 1 < width ? x + 1 : width - 2);
    to[x] = static_cast<std::uint8_t>((left + 2 * middle + right + 8) / 16);
    left = middle;
    middle = right;
  }
}

}  // namespace

const GreyFormat* choose_format(const std::vector<std::string>& offered, std::string_view wanted) noexcept {
  for (const GreyFormat& f : kFormats)
    if ((wanted.empty() || wanted == f.name) && std::find(offered.begin(), offered.end(), f.name) != offered.end()) return &f;
  return nullptr;
}

void to_grey(const GreyFormat& format, const std::uint8_t* from, int width, int height, std::uint8_t* to, std::size_t stride) noexcept {
  const auto w = static_cast<std::size_t>(width);
  for (int y = 0; y < height; ++y) {
    std::uint8_t* row = to + static_cast<std::size_t>(y) * stride;
    const auto source = [&](int r) { return from + static_cast<std::size_t>(r) * w; };
    switch (format.how) {
      case GreyFormat::How::as_it_is:
        std::copy_n(source(y), w, row);
        break;
      case GreyFormat::How::words: {
        const std::uint8_t* p = from + static_cast<std::size_t>(y) * w * 2;
        for (std::size_t x = 0; x < w; ++x) row[x] = static_cast<std::uint8_t>((p[2 * x] | p[2 * x + 1] << 8) >> format.shift);
        break;
      }
      case GreyFormat::How::mosaic:
        mosaic_row(source(y > 0 ? y - 1 : 1), source(y), source(y + 1 < height ? y + 1 : height - 2), width, row);
        break;
    }
  }
}

}  // namespace vergence::gige
