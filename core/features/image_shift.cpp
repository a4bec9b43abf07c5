#include "core/features/image_shift.hpp"

#include <algorithm>
#include <limits>

namespace vergence::features {
namespace {

// Number of steps along the longer side, at least, which bounds the time: a few milliseconds.
constexpr int kSteps = 100;

double mean_squared_difference(const ImageView& before, const ImageView& now, int dx, int dy,
                               int step) noexcept {
  long long sum = 0, square = 0, n = 0;
  for (int y = std::max(0, -dy); y < before.height - std::max(0, dy); y += step) {
    const std::uint8_t *a = before.row(y), *b = now.row(y + dy) + dx;
    for (int x = std::max(0, -dx); x < before.width - std::max(0, dx); x += step, ++n) {
      const int d = b[x] - a[x];
      sum += d;
      square += d * d;
    }
  }
  const double mean = static_cast<double>(sum) / static_cast<double>(n);
  return static_cast<double>(square) / static_cast<double>(n) - mean * mean;
}

}  // namespace

Vec2 image_shift(const ImageView& before, const ImageView& now) noexcept {
  Vec2 best = Vec2::Zero();
  double least = std::numeric_limits<double>::infinity();
  const int step = std::max(1, std::max(before.width, before.height) / kSteps),
            right = before.width / 3 / step * step, down = before.height / 3 / step * step;
  for (int dy = -down; dy <= down; dy += step)
    for (int dx = -right; dx <= right; dx += step) {
      // Every second pixel of every second row suffices, because the images are smooth.
      const double difference = mean_squared_difference(before, now, dx, dy, 2 * step);
      if (!(difference < least)) continue;
      least = difference;
      best = {dx, dy};
    }
  return best;
}

}  // namespace vergence::features
