#include "core/features/detail/surf_descriptor.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace vergence::features::detail {
namespace {

// Number of parts per side.
constexpr int kParts = 4;
// Number of samples per side of a part.
constexpr int kSamples = 5;
// Number of samples per side.
constexpr int kSide = kParts * kSamples;
// Sigmas and radius in units of the scale s.
constexpr float kDescriptorSigma = 3.3F;
constexpr int kReach = 6;
constexpr float kOrientationSigma = 2.F;
constexpr float kSector = std::numbers::pi_v<float> / 3;
constexpr std::size_t kMaxDirections = (2 * kReach + 1) * (2 * kReach + 1);

struct Gradient {
  float x = 0, y = 0;
};

// Maximum coordinate or side, far inside the range of 32-bit integers.
constexpr float kMaxPixels = 1e6F;

/// Half of a wavelet's side, in px.
int half_side(float s) noexcept {
  return s > 1.F ? static_cast<int>(std::lround(std::min(s, kMaxPixels))) : 1;
}

/// Haar wavelets of side 2 h around the corner of pixels nearest to (x, y); zero outside the image,
/// whose edge would otherwise be a gradient.
Gradient haar(const IntegralImage& image, float x, float y, int h) noexcept {
  if (!(std::abs(x) < kMaxPixels && std::abs(y) < kMaxPixels)) return {};
  // Pixel centres are at integers, the corners between them at halves.
  const int cx = static_cast<int>(std::lround(x + 0.5F)),
            cy = static_cast<int>(std::lround(y + 0.5F));
  if (cx < h || cy < h || cx + h > image.width() || cy + h > image.height()) return {};
  const std::uint32_t* top = image.row(cy - h);
  const std::uint32_t* middle = image.row(cy);
  const std::uint32_t* bottom = image.row(cy + h);
  const std::uint32_t left = bottom[cx] - bottom[cx - h] - top[cx] + top[cx - h];
  const std::uint32_t right = bottom[cx + h] - bottom[cx] - top[cx + h] + top[cx];
  const std::uint32_t upper = middle[cx + h] - middle[cx - h] - top[cx + h] + top[cx - h];
  const std::uint32_t lower = bottom[cx + h] - bottom[cx - h] - middle[cx + h] + middle[cx - h];
  return {static_cast<float>(static_cast<std::int32_t>(right - left)),
          static_cast<float>(static_cast<std::int32_t>(lower - upper))};
}

std::array<float, kSide> descriptor_weights() noexcept {
  std::array<float, kSide> w{};
  for (int i = 0; i < kSide; ++i) {
    const float u = (static_cast<float>(i) - 0.5F * (kSide - 1)) / kDescriptorSigma;
    w[static_cast<std::size_t>(i)] = std::exp(-0.5F * u * u);
  }
  return w;
}

const std::array<float, kSide> kWeights = descriptor_weights();

/// Weights by squared distance, in s².
std::array<float, kReach * kReach> circle_weights() noexcept {
  std::array<float, kReach * kReach> w{};
  for (int r2 = 0; r2 < kReach * kReach; ++r2)
    w[static_cast<std::size_t>(r2)] =
        std::exp(-0.5F * static_cast<float>(r2) / (kOrientationSigma * kOrientationSigma));
  return w;
}

const std::array<float, kReach* kReach> kCircleWeights = circle_weights();

struct Direction {
  float angle = 0;
  Gradient g;
};

}  // namespace

float surf_orientation(const IntegralImage& image, float x, float y, float scale) noexcept {
  std::array<Direction, kMaxDirections> directions;
  std::size_t n = 0;
  const int h = half_side(2.F * scale);
  for (int j = -kReach; j <= kReach; ++j) {
    for (int i = -kReach; i <= kReach; ++i) {
      const int r2 = i * i + j * j;
      if (r2 >= kReach * kReach) continue;
      Gradient g =
          haar(image, x + scale * static_cast<float>(i), y + scale * static_cast<float>(j), h);
      if (g.x == 0 && g.y == 0) continue;
      const float w = kCircleWeights[static_cast<std::size_t>(r2)];
      g = {w * g.x, w * g.y};
      directions[n++] = {std::atan2(g.y, g.x), g};
    }
  }
  if (n == 0) return 0.F;
  std::sort(directions.begin(), directions.begin() + static_cast<std::ptrdiff_t>(n),
            [](const Direction& a, const Direction& b) {
              if (a.angle != b.angle) return a.angle < b.angle;
              // A unique order gives a unique sum.
              return a.g.x != b.g.x ? a.g.x < b.g.x : a.g.y < b.g.y;
            });
  // Each sector begins at a direction, because no other start can contain more. Its end only
  // advances.
  float best = -1.F, angle = 0.F;
  Gradient sum;
  // Index of the first direction beyond the sector, which continues after a full turn.
  std::size_t end = 0;
  for (std::size_t first = 0; first < n; ++first) {
    const auto beyond = [&](std::size_t i) noexcept {
      return directions[i % n].angle - directions[first].angle +
                 (i >= n ? 2 * std::numbers::pi_v<float> : 0.F) >=
             kSector;
    };
    for (; end < first + n && !beyond(end); ++end)
      sum = {sum.x + directions[end % n].g.x, sum.y + directions[end % n].g.y};
    const float length = sum.x * sum.x + sum.y * sum.y;
    if (length > best) {
      best = length;
      angle = std::atan2(sum.y, sum.x);
    }
    sum = {sum.x - directions[first].g.x, sum.y - directions[first].g.y};
  }
  return angle;
}

SurfDescriptor surf_descriptor(const IntegralImage& image, const SurfPoint& p) noexcept {
  SurfDescriptor d;
  const int h = half_side(p.scale);
  const float c = std::cos(p.angle), s = std::sin(p.angle);
  for (int j = 0; j < kSide; ++j) {
    for (int i = 0; i < kSide; ++i) {
      const float u = p.scale * (static_cast<float>(i) - 0.5F * (kSide - 1)),
                  v = p.scale * (static_cast<float>(j) - 0.5F * (kSide - 1));
      const Gradient g = haar(image, p.x + c * u - s * v, p.y + s * u + c * v, h);
      const float w = kWeights[static_cast<std::size_t>(i)] * kWeights[static_cast<std::size_t>(j)];
      const float along = w * (c * g.x + s * g.y), stereo = w * (c * g.y - s * g.x);
      float* part = d.values.data() + 4 * (j / kSamples * kParts + i / kSamples);
      part[0] += along;
      part[1] += stereo;
      part[2] += std::abs(along);
      part[3] += std::abs(stereo);
    }
  }
  float square = 0;
  for (const float v : d.values) square += v * v;
  if (!(square > 0)) return {};
  const float scale = 1.F / std::sqrt(square);
  for (float& v : d.values) v *= scale;
  return d;
}

}  // namespace vergence::features::detail
