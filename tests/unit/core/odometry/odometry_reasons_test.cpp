// Reasons against a pose are reported from the first frame that shows them, and no longer.
#include <gtest/gtest.h>

#include "tests/unit/core/odometry/corridor.hpp"

namespace vergence::odometry {
namespace {

// Number of frames before the test begins.
constexpr int kSettled = 10;

/// An image of nothing known.
features::test::Image noise(const ImageView& like) {
  return features::test::white_noise(like.width, like.height, 5);
}

TEST(OdometryReasons, gapAfterAnUnposedFrameIsReported) {
  test::Corridor corridor;
  test::LinkedOdometry f(corridor.rig());
  for (int i = 0; i < kSettled; ++i) ASSERT_TRUE(f.odometry.process(corridor.frame(i)).posed);
  RigFrame frame = corridor.frame(kSettled);
  const features::test::Image nothing = noise(frame.images[0]);
  frame.images[0] = frame.images[1] = nothing.view();
  ASSERT_FALSE(f.odometry.process(frame).posed);

  // Gap in s.
  constexpr double kGap = 4;
  frame = corridor.frame_at(kSettled + 1, kSettled);
  frame.stamp = frame.stamp + Duration::seconds(kGap);
  FrameOutcome out = f.odometry.process(frame);
  ASSERT_TRUE(out.posed);
  EXPECT_NEAR(out.gap_s, kGap, 0.1);
  EXPECT_EQ(out.reason, Reason::time_gap);
  EXPECT_TRUE(out.map_rebuild_due);
}

// The right camera's image confirms little of the left one's at a keyframe, and the rig stands from
// then on: there is no further keyframe to take that back.
TEST(OdometryReasons, missingStereoMatchesAreReportedAndEnd) {
  test::Corridor corridor;
  test::LinkedOdometry f(corridor.rig());
  for (int i = 0; i < kSettled; ++i) ASSERT_TRUE(f.odometry.process(corridor.frame(i)).posed);
  int reported = 0;
  for (int i = kSettled; i < kSettled + 4; ++i) {
    RigFrame frame = corridor.frame(i);
    features::test::Image half = noise(frame.images[1]);
    for (int y = 0; y < half.view().height; ++y)
      for (int x = 0; x < half.view().width / 4; ++x) half.at(x, y) = frame.images[1].row(y)[x];
    frame.images[1] = half.view();
    const FrameOutcome out = f.odometry.process(frame);
    if (out.reason == Reason::no_stereo_matches) ++reported;
    EXPECT_NE(out.status, PoseStatus::ok) << i;
  }
  EXPECT_GT(reported, 0);
  FrameOutcome out;
  for (int i = 0; i < 10; ++i)
    out = f.odometry.process(corridor.frame_at(kSettled + 4 + i, kSettled + 3));
  EXPECT_FALSE(out.keyframe) << "nothing was tested";
  EXPECT_EQ(out.status, PoseStatus::ok) << to_string(out.reason);
}

TEST(OdometryReasons, failedRebuildIsDegraded) {
  test::Corridor corridor;
  test::LinkedOdometry f(corridor.rig());
  for (int i = 0; i < kSettled; ++i) ASSERT_TRUE(f.odometry.process(corridor.frame(i)).posed);
  // Nothing matches with this rig.
  RigCalibration rig = corridor.rig();
  rig.T_camera_left[1].R = exp_so3({0.2, 0, 0}) * rig.T_camera_left[1].R;
  f.odometry.link(rig);
  FrameOutcome out = f.odometry.process(corridor.frame(kSettled));
  ASSERT_EQ(out.status, PoseStatus::ok);
  ASSERT_TRUE(out.relink_due);
  f.odometry.rebuild(&out);
  EXPECT_EQ(out.status, PoseStatus::degraded);
  EXPECT_NE(out.reason, Reason::none);
}

}  // namespace
}  // namespace vergence::odometry
