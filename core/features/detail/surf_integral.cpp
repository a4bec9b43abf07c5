#include "core/features/detail/surf_integral.hpp"

#include <algorithm>
#include <cassert>

namespace vergence::features::detail {
namespace {

std::size_t numbers(int width, int height) noexcept {
  return (static_cast<std::size_t>(std::max(0, width)) + 1) *
         (static_cast<std::size_t>(std::max(0, height)) + 1);
}

}  // namespace

IntegralImage::IntegralImage(int max_width, int max_height, Arena& arena)
    : sums_(arena.make<std::uint32_t>(numbers(max_width, max_height), "integral image")) {}

void IntegralImage::build(const ImageView& image) noexcept {
  assert(numbers(image.width, image.height) <= sums_.size());
  width_ = image.width;
  height_ = image.height;
  const auto columns = static_cast<std::size_t>(width_ + 1);
  std::fill_n(sums_.begin(), columns, 0U);
  for (int y = 0; y < height_; ++y) {
    const std::uint8_t* pixels = image.row(y);
    const std::uint32_t* above = row(y);
    std::uint32_t* here = sums_.data() + static_cast<std::size_t>(y + 1) * columns;
    here[0] = 0;
    std::uint32_t sum = 0;
    for (int x = 0; x < width_; ++x) {
      sum += pixels[x];
      here[x + 1] = above[x + 1] + sum;
    }
  }
}

}  // namespace vergence::features::detail
