#include "core/features/image_shift.hpp"

#include <algorithm>
#include <limits>

namespace vergence::features {
namespace {

// Every second pixel of every second row suffices, because the images are smooth.
constexpr int kStep = 2;

double mean_squared_difference(const ImageView& before, const ImageView& now, int dx,
                               int dy) noexcept {
  long long sum = 0, square = 0, n = 0;
  for (int y = std::max(0, -dy); y < before.height - std::max(0, dy); y += kStep) {
    const std::uint8_t *a = before.row(y), *b = now.row(y + dy) + dx;
    for (int x = std::max(0, -dx); x < before.width - std::max(0, dx); x += kStep, ++n) {
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
  for (int dy = -before.height / 3; dy <= before.height / 3; ++dy)
    for (int dx = -before.width / 3; dx <= before.width / 3; ++dx) {
      const double difference = mean_squared_difference(before, now, dx, dy);
      if (!(difference < least)) continue;
      least = difference;
      best = {dx, dy};
    }
  return best;
}

}  // namespace vergence::features
