#include "drivers/exposure/brightness.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace vergence::exposure {

BrightnessMeter::BrightnessMeter(int width, int height, const ImageView& mask)
    : width_(width), height_(height) {
  const bool masked = !mask.empty() && mask.width == width && mask.height == height;
  const int columns = std::min(kColumns, width), rows = std::min(kRows, height);
  places_.reserve(static_cast<std::size_t>(std::max(0, columns)) *
                  static_cast<std::size_t>(std::max(0, rows)));
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      const int x = (2 * c + 1) * width / (2 * columns), y = (2 * r + 1) * height / (2 * rows);
      if (!masked || mask.at(x, y) != 0)
        places_.push_back({static_cast<std::int16_t>(x), static_cast<std::int16_t>(y)});
    }
  }
}

Brightness BrightnessMeter::measure(const ImageView& image, double may_saturate) const noexcept {
  Brightness b;
  if (image.empty() || image.width != width_ || image.height != height_ || places_.empty())
    return b;
  std::array<int, 256> histogram{};
  for (const Place& p : places_) ++histogram[image.row(p.y)[p.x]];
  const auto n = static_cast<int>(places_.size());
  std::int64_t sum = 0;
  int top = 0;
  for (int v = 0; v < 256; ++v) {
    sum += static_cast<std::int64_t>(v) * histogram[static_cast<std::size_t>(v)];
    if (v >= kSaturated) top += histogram[static_cast<std::size_t>(v)];
  }
  const int above = static_cast<int>(std::floor(std::clamp(may_saturate, 0.0, 1.0) * n));
  int level = 255;
  for (int counted = histogram[255]; counted <= above && level > 0;)
    counted += histogram[static_cast<std::size_t>(--level)];
  b.mean = static_cast<double>(sum) / n;
  b.bright = level;
  b.saturated = static_cast<double>(top) / n;
  b.samples = n;
  return b;
}

}  // namespace vergence::exposure
