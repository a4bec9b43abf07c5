#include "core/features/pyramid.hpp"

#include <cassert>

#include "core/features/detail/downsample.hpp"

namespace vergence::features {
namespace {

// Minimum side of a level in px, below which a patch hardly fits.
constexpr int kSmallestSide = 32;

struct Size {
  int width, height;
};

int usable_levels(int width, int height, int levels) noexcept {
  int n = 1;
  Size s{width, height};
  while (n < levels && (s.width + 1) / 2 >= kSmallestSide && (s.height + 1) / 2 >= kSmallestSide) {
    s = {(s.width + 1) / 2, (s.height + 1) / 2};
    ++n;
  }
  return n;
}

std::size_t padded_stride(int width) noexcept {
  return (static_cast<std::size_t>(width) + kCacheLine - 1) / kCacheLine * kCacheLine;
}

}  // namespace

Pyramid::Pyramid(int width, int height, int levels, Arena& arena)
    : levels_(usable_levels(width, height, levels)) {
  assert(levels >= 1 && levels <= kMaxPyramidLevels);
  Size s{width, height};
  views_[0] = {nullptr, width, height, 0};
  for (int l = 1; l < levels_; ++l) {
    s = {(s.width + 1) / 2, (s.height + 1) / 2};
    const std::size_t stride = padded_stride(s.width);
    // Add a cache line, because vector loads of the last row may exceed it.
    const auto bytes = arena.make<std::uint8_t>(
        stride * static_cast<std::size_t>(s.height) + kCacheLine, "pyramid");
    const auto i = static_cast<std::size_t>(l);
    storage_[i] = bytes.data();
    views_[i] = {bytes.data(), s.width, s.height, static_cast<std::ptrdiff_t>(stride)};
  }
  row_ = arena.make<std::uint16_t>(detail::filtered_row_length(width), "pyramid row").data();
}

void Pyramid::build(const ImageView& image) noexcept {
  assert(image.width == views_[0].width && image.height == views_[0].height);
  views_[0] = image;
  for (int l = 1; l < levels_; ++l) {
    const auto i = static_cast<std::size_t>(l);
    detail::downsample(views_[i - 1], storage_[i], views_[i], row_);
  }
}

}  // namespace vergence::features
