#include "core/features/image_shift.hpp"

#include <gtest/gtest.h>

#include "tests/unit/core/features/texture.hpp"

namespace vergence::features {
namespace {

using namespace test;

// An eighth of 752×480. The waves are longer than two samples, and of no common period.
constexpr int kWidth = 94, kHeight = 60;

TEST(ImageShift, shiftIsFoundWhateverTheBrightness) {
  const Texture texture(5, 12, 60);
  const Image before = draw(kWidth, kHeight, texture, 3);
  // None, both signs, and the largest that is searched.
  for (const Vec2& shift : {Vec2(0, 0), Vec2(7, -4), Vec2(-20, 11), Vec2(31, 20), Vec2(-31, -20)}) {
    const Image now = draw(kWidth, kHeight, [&](const Vec2& p) { return texture(p - shift) + 20; });
    EXPECT_EQ(image_shift(before.view(), now.view()), shift) << shift.transpose();
  }
}

// The coarsest level of a camera of five megapixels.
TEST(ImageShift, largeImagesAreSearchedInSteps) {
  const Texture texture(6, 40, 200);
  const Vec2 shift(31, -20);
  const Image before = draw(306, 256, texture);
  const Image now = draw(306, 256, [&](const Vec2& p) { return texture(p - shift); });
  EXPECT_LE((image_shift(before.view(), now.view()) - shift).lpNorm<Eigen::Infinity>(), 3);
}

TEST(ImageShift, emptyImagesHaveNone) { EXPECT_EQ(image_shift({}, {}), Vec2::Zero()); }

}  // namespace
}  // namespace vergence::features
