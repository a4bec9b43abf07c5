#include <gtest/gtest.h>

#include "core/memory/allocation_guard.hpp"
#include "core/odometry/front_end.hpp"
#include "tests/unit/core/features/texture.hpp"

namespace vergence::odometry {
namespace {

constexpr int kWidth = 320, kHeight = 240;

RigCalibration blank_rig() {
  RigCalibration rig;
  rig.cameras = 2;
  for (std::size_t k = 0; k < 2; ++k) {
    rig.intrinsics[k].width = kWidth;
    rig.intrinsics[k].height = kHeight;
    rig.intrinsics[k].fx = rig.intrinsics[k].fy = 300;
    rig.intrinsics[k].cx = 160;
    rig.intrinsics[k].cy = 120;
  }
  return rig;
}

/// 0: corners, 1: SURF-64.
class FreeMatches : public ::testing::TestWithParam<int> {
 protected:
  [[nodiscard]] static OdometryOptions options() {
    OdometryOptions o;
    o.features = 300;
    o.init_features = GetParam();
    return o;
  }
};

TEST_P(FreeMatches, shiftedImageIsMatchedWithoutAllocations) {
  const OdometryOptions o = options();
  const RigCalibration rig = blank_rig();
  Arena arena;
  SequentialRunner runner;
  FrontEnd front(o, rig, arena, runner);
  const features::test::Texture fine(3, 7, 24), coarse(4, 20, 80);
  const Vec2 shift(23.3, -8.6);
  const auto brightness = [&](const Vec2& p) { return 0.9 * fine(p) + 0.5 * coarse(p) - 51; };
  const features::test::Image left = features::test::draw(kWidth, kHeight, brightness, 64),
                              right = features::test::draw(
                                  kWidth, kHeight,
                                  [&](const Vec2&p) { return brightness(p - shift); }, 64);
  RigFrame frame;
  frame.cameras = 2;
  frame.images[0] = left.view();
  frame.images[1] = right.view();
  const std::uint64_t before = AllocationGuard::runtime_allocations();
  std::span<const FreeMatch> matches;
  {
    const SealedScope sealed;
    (void)front.begin(frame);
    matches = front.match_free(1);
  }
  EXPECT_EQ(AllocationGuard::runtime_allocations(), before);
  ASSERT_GE(matches.size(), 30U);
  std::size_t right_ones = 0;
  // Three sigmas of a corner's place: both are the same pixels but for the rounding of grey values.
  for (const FreeMatch& m : matches)
    right_ones += (m.other - m.left - shift).norm() < 3 * o.pixel_sigma ? 1U : 0U;
  EXPECT_GE(static_cast<double>(right_ones), 0.9 * static_cast<double>(matches.size()));
}

TEST_P(FreeMatches, missingOrFlatImageHasNoMatch) {
  const OdometryOptions o = options();
  const RigCalibration rig = blank_rig();
  Arena arena;
  SequentialRunner runner;
  FrontEnd front(o, rig, arena, runner);
  EXPECT_TRUE(front.match_free(1).empty());
  const features::test::Image flat(kWidth, kHeight, 64),
      noise = features::test::white_noise(kWidth, kHeight, 1, 64);
  RigFrame frame;
  frame.cameras = 2;
  frame.images[0] = noise.view();
  (void)front.begin(frame);
  EXPECT_TRUE(front.match_free(1).empty());
  frame.images[1] = flat.view();
  (void)front.begin(frame);
  EXPECT_TRUE(front.match_free(1).empty());
}

INSTANTIATE_TEST_SUITE_P(ByCornersAndBlobs, FreeMatches, ::testing::Values(0, 1));

}  // namespace
}  // namespace vergence::odometry
