#include "core/features/pyramid.hpp"

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "tests/unit/core/features/texture.hpp"

namespace vergence::features {
namespace {

using namespace test;

int different_pixels(const ImageView& a, const ImageView& b) {
  if (a.width != b.width || a.height != b.height) return -1;
  int n = 0;
  for (int y = 0; y < a.height; ++y)
    for (int x = 0; x < a.width; ++x) n += a.at(x, y) != b.at(x, y) ? 1 : 0;
  return n;
}

struct Size {
  int width, height;
};
// Even and odd, around multiples of every vector length, and one narrower than a vector.
constexpr std::array kSizes{Size{752, 480}, Size{753, 481}, Size{64, 64},   Size{65, 63},
                            Size{127, 97},  Size{129, 66},  Size{191, 200}, Size{1226, 370}};

TEST(Pyramid, levelsMatchOpenCvOnEveryTarget) {
  for (const Size s : kSizes) {
    const Image image = white_noise(s.width, s.height, 8);
    test::on_every_target([&](const char* target) {
      const Built b(image.view(), 4);
      cv::Mat from(s.height, s.width, CV_8U, const_cast<std::uint8_t*>(image.bytes.data()),
                   static_cast<std::size_t>(image.stride));
      for (int l = 1; l < b.pyramid.levels(); ++l) {
        cv::Mat to;
        cv::pyrDown(from, to);
        EXPECT_EQ(different_pixels(b.pyramid.level(l), {to.data, to.cols, to.rows,
                                                        static_cast<std::ptrdiff_t>(to.step)}),
                  0)
            << target << ", " << s.width << "×" << s.height << ", level " << l;
        from = to;
      }
    });
  }
}

TEST(Pyramid, noByteOutsideTheImageIsRead) {
  for (const Size s : {Size{101, 75}, Size{64, 64}, Size{97, 66}})
    for (const auto guard :
         {test::GuardedImage::Guard::before, test::GuardedImage::Guard::behind}) {
      const Image noise = white_noise(s.width, s.height, 3);
      const test::GuardedImage guarded(noise, guard);
      test::on_every_target([&](const char*) {
        const Built inside(guarded.view(), 2), free(noise.view(), 2);
        EXPECT_EQ(different_pixels(inside.pyramid.level(1), free.pyramid.level(1)), 0);
      });
    }
}

TEST(Pyramid, smallImageHasFewerLevels) {
  const Image image = white_noise(70, 200, 1);
  const Built b(image.view(), 6);
  EXPECT_EQ(b.pyramid.level(0).data, image.bytes.data());
  // The widths are 70, 35 and 18 px; no side may be below 32 px.
  ASSERT_EQ(b.pyramid.levels(), 2);
  EXPECT_EQ(b.pyramid.level(1).width, 35);
}

}  // namespace
}  // namespace vergence::features
