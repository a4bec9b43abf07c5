#include "core/features/mask.hpp"

#include <algorithm>
#include <cmath>

namespace vergence::features {
Mask::Mask(const ImageView& image, int margin, Arena& arena) {
  if (image.empty()) return;
  width_ = image.width;
  height_ = image.height;
  words_per_row_ = (static_cast<std::size_t>(width_) + 63U) / 64U;
  bits_ = arena.make<std::uint64_t>(words_per_row_ * static_cast<std::size_t>(height_), "mask");
  for (int y = 0; y < height_; ++y) {
    const std::uint8_t* row = image.row(y);
    for (int x = 0; x < width_;) {
      if (row[x] != 0) {
        ++x;
        continue;
      }
      const int first = x;
      while (x < width_ && row[x] == 0) ++x;
      for (int at = std::max(0, y - margin); at <= std::min(height_ - 1, y + margin); ++at)
        hide(std::max(0, first - margin), std::min(width_, x + margin), at);
    }
  }
}

void Mask::hide(int first, int last, int y) noexcept {
  for (int x = first; x < last;) {
    const unsigned from = static_cast<unsigned>(x) % 64U;
    const unsigned n = std::min(64U - from, static_cast<unsigned>(last - x));
    const std::uint64_t ones = n == 64U ? ~std::uint64_t{0} : (std::uint64_t{1} << n) - 1U;
    bits_[word(x, y)] |= ones << from;
    x += static_cast<int>(n);
  }
}

bool Mask::hides(const Vec2& pixel) const noexcept {
  if (bits_.empty() || !(pixel.cwiseAbs().maxCoeff() < 1e6)) return false;
  return hides(static_cast<int>(std::lround(pixel.x())), static_cast<int>(std::lround(pixel.y())));
}

}  // namespace vergence::features
