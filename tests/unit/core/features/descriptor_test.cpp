#include "core/features/descriptor.hpp"

#include <gtest/gtest.h>

#include "tests/unit/core/features/texture.hpp"

namespace vergence::features {
namespace {

using namespace test;

constexpr int kWidth = 120, kHeight = 120;

/// The descriptor at the middle of a picture.
template <class Value>
Descriptor of(const Value& value) {
  const test::Image image = draw(kWidth, kHeight, value);
  const test::Built built(image.view());
  Patch patch{};
  EXPECT_TRUE(cut_patch(built.pyramid, {60, 60}, &patch));
  return describe(patch);
}

TEST(Descriptor, changedViewIsNearerThanAnyOtherPlace) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const Texture texture(seed);
    const Descriptor here = of(texture);
    Random random(seed);
    const double angle = 10 * std::numbers::pi / 180;
    Mat2 turn;
    turn << std::cos(angle), -std::sin(angle), std::sin(angle), std::cos(angle);
    const Vec2 middle(60, 60);
    const int noisy = distance(
        here, of([&](const Vec2& p) { return 0.7 * texture(p) + 20 + 5 * random.normal(); }));
    const int turned = distance(
        here, of([&](const Vec2& p) { return texture(middle + 1.1 * (turn * (p - middle))); }));
    int other = 256;
    for (std::uint64_t k = 1; k <= 10; ++k)
      other = std::min(other, distance(here, of(Texture(1000 + 10 * seed + k))));
    EXPECT_LT(noisy, other) << seed;
    EXPECT_LT(turned, other) << seed;
  }
}

}  // namespace
}  // namespace vergence::features
