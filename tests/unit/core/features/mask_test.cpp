#include "core/features/mask.hpp"

#include <gtest/gtest.h>

#include "core/features/corners.hpp"
#include "core/features/surf.hpp"
#include "tests/unit/core/features/texture.hpp"

namespace vergence::features {
namespace {

using namespace test;

constexpr int kWidth = 333, kHeight = 247;

/// Shows everything but a few single pixels and a block that crosses two words' edges.
Image spotted() {
  Image image(kWidth, kHeight, 5, 0);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) image.at(x, y) = static_cast<std::uint8_t>(1 + (x + y) % 255);
  image.at(0, 0) = image.at(kWidth - 1, kHeight - 1) = image.at(64, 100) = 0;
  for (int y = 30; y < 60; ++y)
    for (int x = 50; x < 210; ++x) image.at(x, y) = 0;
  return image;
}

/// Shows the left part only.
Image half_hidden(int from_x) {
  Image image(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < from_x; ++x) image.at(x, y) = 255;
  return image;
}

TEST(Mask, zeroPixelsAndTheirMarginAreHidden) {
  const Image image = spotted();
  for (const int margin : {0, 1, 7}) {
    Arena arena;
    const Mask mask(image.view(), margin, arena);
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) {
        bool near = false;
        for (int v = std::max(0, y - margin); v <= std::min(kHeight - 1, y + margin); ++v)
          for (int u = std::max(0, x - margin); u <= std::min(kWidth - 1, x + margin); ++u)
            near = near || image.view().at(u, v) == 0;
        ASSERT_EQ(mask.hides(x, y), near) << x << ", " << y << ", margin " << margin;
      }
  }
}

TEST(Mask, emptyMaskAndOutsideHideNothing) {
  Arena arena;
  EXPECT_FALSE(Mask().hides(3, 3));
  EXPECT_TRUE(Mask(ImageView{}, 7, arena).empty());
  const Image black(kWidth, kHeight);
  const Mask mask(black.view(), 7, arena);
  EXPECT_TRUE(mask.hides(Vec2(0, 0)));
  EXPECT_FALSE(mask.hides(Vec2(-1, 3)));
  EXPECT_FALSE(mask.hides(Vec2(kWidth, 3)));
  EXPECT_FALSE(mask.hides(Vec2(std::nan(""), 3)));
  EXPECT_FALSE(mask.hides(Vec2(1e300, 3)));
}

TEST(Mask, maskedBlobsTakeNoCapacity) {
  const Image image = draw(kWidth, kHeight, Texture(5));
  const Image shown = half_hidden(kWidth / 2);
  Arena arena;
  const Mask mask(shown.view(), 0, arena);
  Surf surf(kWidth, kHeight, arena);
  ASSERT_EQ(surf.set_image(image.view()), SurfStatus::ok);
  SurfOptions options;
  const auto find = [&](std::size_t room) {
    std::vector<SurfPoint> storage(room);
    BoundedVector<SurfPoint> points(storage);
    (void)surf.detect(options, &points);
    return std::vector<SurfPoint>(points.begin(), points.end());
  };
  std::vector<SurfPoint> expected = find(5000);
  std::erase_if(expected, [&](const SurfPoint& p) { return mask.hides(Vec2(p.x, p.y)); });
  constexpr std::size_t kRoom = 40;
  ASSERT_GT(expected.size(), kRoom);
  options.mask = &mask;
  const std::vector<SurfPoint> found = find(kRoom);
  ASSERT_EQ(found.size(), kRoom);
  for (std::size_t i = 0; i < kRoom; ++i) {
    EXPECT_EQ(found[i].x, expected[i].x);
    EXPECT_EQ(found[i].y, expected[i].y);
  }
}

}  // namespace
}  // namespace vergence::features
