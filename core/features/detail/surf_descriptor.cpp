#include "core/features/detail/surf_descriptor.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace vergence::features::detail {
namespace {

// Number of parts per side.
constexpr int kParts = 4;
// Number of samples per side of a part.
constexpr int kSamples = 5;
// Number of samples per side.
constexpr int kSide = kParts * kSamples;
// Sigma in units of the scale s.
constexpr float kDescriptorSigma = 3.3F;

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

}  // namespace

SurfDescriptor surf_descriptor(const IntegralImage& image, const SurfPoint& p) noexcept {
  SurfDescriptor d;
  const int h = half_side(p.scale);
  for (int j = 0; j < kSide; ++j) {
    for (int i = 0; i < kSide; ++i) {
      const float u = p.scale * (static_cast<float>(i) - 0.5F * (kSide - 1)),
                  v = p.scale * (static_cast<float>(j) - 0.5F * (kSide - 1));
      const Gradient g = haar(image, p.x + u, p.y + v, h);
      const float w = kWeights[static_cast<std::size_t>(i)] * kWeights[static_cast<std::size_t>(j)];
      const float along = w * g.x, stereo = w * g.y;
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
