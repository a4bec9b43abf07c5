#include <gtest/gtest.h>

#include "tests/unit/core/odometry/corridor.hpp"

namespace vergence::odometry {
namespace {

// A truck in the next lane: most of what the cameras see moves as the rig does, so the pose stands
// and no keyframe is due. The last is made at frame 4, where a few points that the panel hid still
// look like its own; three frames later new ones are tried.
constexpr int kFound = 8;

void expect_the_panel_is_told(Duration budget) {
  test::Corridor corridor;
  test::LinkedOdometry f(corridor.rig());
  corridor.show_panel();
  int followed = 0;
  for (int i = 0; i < 20; ++i) {
    const FrameOutcome out = f.odometry.process(corridor.frame(i), budget);
    if (i < kFound || !out.posed) continue;
    const double travelled =
        (test::Corridor::T_world_left(i).t - test::Corridor::T_world_left(0).t).norm();
    const bool stands = out.T_left_world.centre().norm() < 0.5 * travelled;
    if (!stands) continue;
    ++followed;
    EXPECT_TRUE(out.moving) << i;
  }
  EXPECT_GT(followed, 5) << "the panel is not large enough to be followed: nothing was tested";
}

TEST(OdometryMoving, panelMovingAlongIsReported) { expect_the_panel_is_told(Duration{}); }

TEST(OdometryMoving, panelIsReportedWithASmallBudget) {
  expect_the_panel_is_told(Duration::milliseconds(1));
}

}  // namespace
}  // namespace vergence::odometry
