// Conditions for starting a scene.
#include <gtest/gtest.h>

#include "tests/unit/core/odometry/corridor.hpp"

namespace vergence::odometry {
namespace {

// A successor that fails is no reason to have nothing: the calibration before it is kept.
TEST(OdometryStart, failedCalibrationResumesThePreviousOne) {
  constexpr int kLink = 5, kDark = 8, kBack = 30;
  test::Corridor corridor;
  test::LinkedOdometry f(corridor.rig());
  RigCalibration wrong = corridor.rig();
  wrong.T_camera_left[1].R = exp_so3({0.3, 0, 0}) * wrong.T_camera_left[1].R;
  bool resumed = false;
  for (int i = 0; i < kBack + 8; ++i) {
    RigFrame frame = corridor.frame(i);
    if (i >= kDark && i < kBack) frame.images = {};
    if (i == kLink) f.odometry.link(wrong);
    FrameOutcome out = f.odometry.process(frame);
    f.odometry.rebuild(&out);
    EXPECT_EQ(out.relinked && !out.resumed, i == kLink) << i;
    // Three frames with images that cannot be followed end the scene; the next begins another.
    if (i >= kBack + 4) {
      EXPECT_TRUE(out.posed) << i;
    }
    resumed = resumed || out.resumed;
  }
  EXPECT_TRUE(resumed);
  EXPECT_TRUE(
      f.odometry.rig().T_camera_left[1].R.isApprox(corridor.rig().T_camera_left[1].R, 2e-3));
}

TEST(OdometryStart, disconnectedCameraMemoryIsNotRead) {
  using Guard = features::test::GuardedImage::Guard;
  constexpr int kGone = 6, kBack = 60;
  test::Corridor corridor;
  test::LinkedOdometry f(corridor.rig());
  RigFrame frame;
  for (int i = 0; i < kGone; ++i) {
    frame = corridor.frame(i);
    features::test::GuardedImage left(features::test::copy_of(frame.images[0]), Guard::before);
    frame.images[0] = left.view();
    EXPECT_TRUE(f.odometry.process(frame).posed) << i;
    // A camera's driver takes the memory back when it begins anew.
    left.forbid();
  }
  int lost = 0;
  for (int i = kGone; i < kBack; ++i) {
    frame = corridor.frame(i);
    frame.images[0] = {};
    const FrameOutcome out = f.odometry.process(frame);
    EXPECT_NE(out.status, PoseStatus::ok) << i;
    if (out.posed) continue;
    ++lost;
    EXPECT_EQ(out.reason, Reason::no_image) << i;
  }
  EXPECT_GT(lost, 10) << "the map outlived the camera: no scene was begun without it";
  int posed = 0;
  for (int i = kBack; i < kBack + 20; ++i) posed += f.odometry.process(corridor.frame(i)).posed;
  EXPECT_GT(posed, 15);
}

TEST(OdometryStart, startWithoutAllCamerasIsDegraded) {
  test::Corridor corridor(3);
  test::LinkedOdometry f(corridor.rig());
  RigFrame frame = corridor.frame(0);
  frame.images[2] = {};
  const FrameOutcome out = f.odometry.process(frame);
  EXPECT_TRUE(out.posed);
  EXPECT_EQ(out.status, PoseStatus::degraded);
  EXPECT_EQ(out.reason, Reason::no_image);
}

// 20 mm of baseline: everything matches, nearly all of it with a disparity that measures no depth.
TEST(OdometryStart, farSceneIsReportedAsWeakGeometry) {
  test::Corridor corridor;
  RigCalibration rig = corridor.rig();
  rig.T_camera_left[1].t *= 0.02 / rig.baseline;
  rig.baseline = 0.02;
  test::LinkedOdometry f(rig);
  for (int i = 0; i < 10; ++i) {
    const FrameOutcome out = f.odometry.process(corridor.frame(i, rig.T_camera_left));
    EXPECT_FALSE(out.posed) << i;
    EXPECT_EQ(out.reason, Reason::weak_geometry) << i << ' ' << to_string(out.reason);
  }
}

}  // namespace
}  // namespace vergence::odometry
