#include "core/features/descriptor.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "core/math/random.hpp"

namespace vergence::features {
namespace {

// Radius of the smoothing box.
constexpr int kSmooth = 2;
// Maximum distance from the middle, in px.
constexpr int kReach = kPatchSide / 2 - kSmooth - 1;
constexpr std::uint64_t kPatternSeed = 20260131;

struct Pair {
  // Indices in the patch.
  std::int16_t a, b;
};

std::array<Pair, 256> make_pattern() noexcept {
  Random random(kPatternSeed);
  // Gaussian around the middle with a fifth of the side, the paper's best choice.
  const auto place = [&random]() noexcept {
    const auto one = [&random]() noexcept {
      return std::clamp(static_cast<int>(std::lround(random.normal() * kPatchSide / 5.0)), -kReach,
                        kReach) +
             kPatchSide / 2;
    };
    const int y = one(), x = one();
    return static_cast<std::int16_t>(y * kPatchSide + x);
  };
  std::array<Pair, 256> pattern{};
  for (Pair& p : pattern) {
    p.a = place();
    p.b = place();
  }
  return pattern;
}

const std::array<Pair, 256> kPattern = make_pattern();

}  // namespace

Descriptor describe(const Patch& patch) noexcept {
  const auto level =
      static_cast<std::size_t>(std::clamp(kDescriptorLevel, 0, std::max(0, patch.levels - 1)));
  const auto& pixels = patch.pixels[level];
  std::array<std::uint16_t, kPatchSide * kPatchSide> smooth{};
  for (int y = kSmooth; y < kPatchSide - kSmooth; ++y) {
    for (int x = kSmooth; x < kPatchSide - kSmooth; ++x) {
      int sum = 0;
      for (int dy = -kSmooth; dy <= kSmooth; ++dy)
        for (int dx = -kSmooth; dx <= kSmooth; ++dx)
          sum += pixels[static_cast<std::size_t>((y + dy) * kPatchSide + x + dx)];
      smooth[static_cast<std::size_t>(y * kPatchSide + x)] = static_cast<std::uint16_t>(sum);
    }
  }
  Descriptor d;
  for (std::size_t i = 0; i < kPattern.size(); ++i) {
    const bool less = smooth[static_cast<std::size_t>(kPattern[i].a)] <
                      smooth[static_cast<std::size_t>(kPattern[i].b)];
    d.bits[i / 64] |= static_cast<std::uint64_t>(less) << (i % 64);
  }
  return d;
}

int distance(const Descriptor& a, const Descriptor& b) noexcept {
  int n = 0;
  for (std::size_t i = 0; i < a.bits.size(); ++i) n += std::popcount(a.bits[i] ^ b.bits[i]);
  return n;
}

}  // namespace vergence::features
