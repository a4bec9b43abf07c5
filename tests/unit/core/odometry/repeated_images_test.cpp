// Which images are taken for ones that were seen before.
#include <gtest/gtest.h>

#include <utility>

#include "core/odometry/front_end.hpp"
#include "tests/unit/core/features/texture.hpp"

namespace vergence::odometry {
namespace {

using features::test::Image;
using features::test::white_noise;

constexpr int kWidth = 320, kHeight = 240;

/// The front end of a pair whose pyramids have one level: images are compared as they are.
struct Pair {
  OdometryOptions options;
  RigCalibration rig = small_rig();
  SequentialRunner runner;
  Arena arena;
  FrontEnd front_end;

  Pair() : options{.pyramid_levels = 1}, front_end(options, rig, arena, runner) {}
  static RigCalibration small_rig() {
    RigCalibration rig;
    rig.cameras = 2;
    for (std::size_t k = 0; k < 2; ++k) {
      Intrinsics& c = rig.intrinsics[k];
      c.width = kWidth, c.height = kHeight, c.fx = c.fy = 300, c.cx = 160, c.cy = 120;
    }
    return rig;
  }
  [[nodiscard]] ImageCheck give(const Image& left, const Image& right) {
    RigFrame frame;
    frame.cameras = 2;
    frame.images[0] = left.view();
    frame.images[1] = right.view();
    return front_end.begin(frame);
  }
};

TEST(RepeatedImages, identicalImageIsRepeated) {
  Pair pair;
  const Image right = white_noise(kWidth, kHeight, 2);
  EXPECT_FALSE(pair.give(white_noise(kWidth, kHeight, 1), right).repeated);
  const ImageCheck again = pair.give(white_noise(kWidth, kHeight, 3), right);
  EXPECT_TRUE(again.repeated);
  EXPECT_FALSE(again.left_repeated);
  EXPECT_TRUE(again.uneven);
  EXPECT_EQ(again.given, 0b11);
  EXPECT_EQ(again.structured, 0b01) << "it shows nothing of this frame";
}

TEST(RepeatedImages, permutedPixelsAreNotRepeated) {
  Pair pair;
  Image right = white_noise(kWidth, kHeight, 2);
  ASSERT_FALSE(pair.give(white_noise(kWidth, kHeight, 1), right).repeated);
  ASSERT_NE(right.at(100, 60), right.at(101, 60));
  std::swap(right.at(100, 60), right.at(101, 60));
  const ImageCheck exchanged = pair.give(white_noise(kWidth, kHeight, 3), right);
  EXPECT_FALSE(exchanged.repeated);
  EXPECT_EQ(exchanged.structured, 0b11);
  EXPECT_FALSE(exchanged.uneven);
}

}  // namespace
}  // namespace vergence::odometry
