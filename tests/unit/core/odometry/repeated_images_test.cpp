// Which images are taken for ones that were seen before.
#include <gtest/gtest.h>

#include <utility>

#include "core/odometry/front_end.hpp"
#include "tests/support/parallel_rig.hpp"
#include "tests/unit/core/features/texture.hpp"

namespace vergence::odometry {
namespace {

using namespace features::test;

constexpr int kWidth = 320, kHeight = 240;

/// The front end of a pair whose pyramids have one level: images are compared as they are.
struct Pair {
  OdometryOptions options{.pyramid_levels = 1};
  RigCalibration rig = vergence::test::parallel_rig(
      {.width = kWidth, .height = kHeight, .fx = 300, .fy = 300, .cx = 160, .cy = 120}, 0);
  SequentialRunner runner;
  Arena arena;
  FrontEnd front_end{options, rig, arena, runner};

  [[nodiscard]] ImageCheck give(const Image& left, const Image& right) {
    RigFrame frame{.cameras = 2};
    frame.images[0] = left.view();
    frame.images[1] = right.view();
    return front_end.begin(frame);
  }
};

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
