#include "core/odometry/front_end.hpp"

#include <utility>

#include "tests/support/no_allocations.hpp"
#include "tests/support/parallel_rig.hpp"
#include "tests/unit/core/features/texture.hpp"

namespace vergence::odometry {
namespace {

constexpr int kWidth = 320, kHeight = 240;

RigCalibration blank_rig() {
  return vergence::test::parallel_rig(
      {.width = kWidth, .height = kHeight, .fx = 300, .fy = 300, .cx = 160, .cy = 120}, 0);
}

/// 0: corners, 1: SURF-64.
class FreeMatches : public ::testing::TestWithParam<int> {
 protected:
  OdometryOptions options_{.features = 300, .init_features = GetParam()};
  RigCalibration rig_ = blank_rig();
  Arena arena_;
  SequentialRunner runner_;
  FrontEnd front_{options_, rig_, arena_, runner_};
};

TEST_P(FreeMatches, shiftedImageIsMatchedWithoutAllocations) {
  const features::test::Texture fine(3, 7, 24), coarse(4, 20, 80);
  const Vec2 shift(23.3, -8.6);
  const auto brightness = [&](const Vec2& p) { return 0.9 * fine(p) + 0.5 * coarse(p) - 51; };
  const features::test::Image left = features::test::draw(kWidth, kHeight, brightness, 64),
                              right = features::test::draw(
                                  kWidth, kHeight,
                                  [&](const Vec2&p) { return brightness(p - shift); }, 64);
  RigFrame frame{.cameras = 2};
  frame.images[0] = left.view();
  frame.images[1] = right.view();
  std::span<const FreeMatch> matches;
  vergence::test::expect_no_allocations([&] {
    (void)front_.begin(frame);
    matches = front_.match_free(1);
  });
  ASSERT_GE(matches.size(), 30U);
  std::size_t right_ones = 0;
  // Three sigmas of a corner's place: both are the same pixels but for the rounding of grey values.
  for (const FreeMatch& m : matches)
    right_ones += (m.other - m.left - shift).norm() < 3 * options_.pixel_sigma ? 1U : 0U;
  EXPECT_GE(static_cast<double>(right_ones), 0.9 * static_cast<double>(matches.size()));
}

TEST_P(FreeMatches, missingOrFlatImageHasNoMatch) {
  EXPECT_TRUE(front_.match_free(1).empty());
  const features::test::Image flat(kWidth, kHeight, 64),
      noise = features::test::white_noise(kWidth, kHeight, 1, 64);
  RigFrame frame{.cameras = 2};
  frame.images[0] = noise.view();
  (void)front_.begin(frame);
  EXPECT_TRUE(front_.match_free(1).empty());
  frame.images[1] = flat.view();
  (void)front_.begin(frame);
  EXPECT_TRUE(front_.match_free(1).empty());
}

INSTANTIATE_TEST_SUITE_P(ByCornersAndBlobs, FreeMatches, ::testing::Values(0, 1));

// Which images are taken for ones that were seen before.

using namespace features::test;

/// The front end of a pair whose pyramids have one level: images are compared as they are.
struct Pair {
  OdometryOptions options{.pyramid_levels = 1};
  RigCalibration rig = blank_rig();
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
