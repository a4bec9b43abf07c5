#include <gtest/gtest.h>

#include "tests/unit/core/odometry/corridor.hpp"

namespace vergence::odometry {
namespace {

using test::Corridor;

// A corner is found to 0.1 px, 0.4 mrad at 280 px of focal length. A hundred of them hold rotation
// and shift together to some 0.2 mrad, and that over 12 m of corridor is a few millimetres; up to
// ten keyframes hand their errors on: 0.6 mrad, 8 mm. Three times that. The cameras' transform of
// one frame is the difference of two such poses, one drifting with the other.
// The limits are in rad and m.
constexpr double kTurn = 2e-3, kShift = 0.025;

struct Drive {
  Corridor corridor;
  OdometryOptions options;
  RigCalibration given;
  Arena arena;
  SequentialRunner runner;
  Odometry odometry;
  explicit Drive(bool known, int cameras = 2)
      : corridor(cameras),
        given(corridor.rig()),
        odometry(options, blank(&given, known), known, arena, runner) {}
  static const RigCalibration& blank(RigCalibration* rig, bool known) {
    if (!known)
      for (Transform& T : rig->T_camera_left) T = {};
    return *rig;
  }
};

double turn(const Transform& a, const Transform& b) {
  return log_so3(a.R * b.R.transpose()).norm();
}

/// The pose of frame i against the truth; the world is the left camera of frame 0.
void expect_pose(const FrameOutcome& out, int i) {
  const Transform truth = Corridor::T_world_left(i).inverse() * Corridor::T_world_left(0);
  EXPECT_LT(turn(out.T_left_world, truth), kTurn) << i;
  EXPECT_LT((out.T_left_world.centre() - truth.centre()).norm(),
            kShift + 0.01 * truth.centre().norm())
      << i;
}

void expect_rig(const Odometry& odometry, int k, const Transform& truth, int i) {
  const Transform& found = odometry.rig().T_camera_left[static_cast<std::size_t>(k)];
  EXPECT_LT(turn(found, truth), kTurn) << "frame " << i << " camera " << k;
  EXPECT_LT((found.t - truth.t).norm(), kShift) << "frame " << i << " camera " << k;
}

TEST(OdometryUnlinked, firstPairsGiveTransformAndScale) {
  Drive d(false);
  int initialised = -1;
  for (int i = 0; i < 20; ++i) {
    const FrameOutcome out = d.odometry.process(d.corridor.frame(i));
    if (out.initialised) initialised = i;
    if (initialised < 0) continue;
    ASSERT_TRUE(out.posed || out.initialised) << i;
    EXPECT_EQ(out.status, PoseStatus::degraded) << "without a calibration nothing is ok";
    EXPECT_EQ(d.odometry.linked(), Link::unlinked);
    if (initialised == 0 && i > 2) {
      expect_pose(out, i);
      expect_rig(d.odometry, 1, d.corridor.rig().T_camera_left[1], i);
    }
  }
  EXPECT_EQ(initialised, 0) << "there is enough to see from the start";
}

TEST(OdometryUnlinked, knockIsAMotionOfOneCamera) {
  Drive d(true);
  std::array<Transform, kMaxCameras> knocked = d.corridor.rig().T_camera_left;
  knocked[1] = perturbed(knocked[1], {0.006, -0.004, 0.005}, Vec3::Zero());
  for (int i = 0; i < 4; ++i)
    ASSERT_TRUE(d.odometry.process(d.corridor.frame(i)).status == PoseStatus::ok) << i;
  d.odometry.unlink();
  EXPECT_EQ(d.odometry.linked(), Link::unlinked);
  for (int i = 4; i < 20; ++i) {
    const FrameOutcome out = i < 8 ? d.odometry.process(d.corridor.frame(i))
                                   : d.odometry.process(d.corridor.frame(i, knocked));
    ASSERT_TRUE(out.posed) << i;
    EXPECT_NE(out.status, PoseStatus::ok) << i;
    expect_pose(out, i);
    expect_rig(d.odometry, 1, i < 8 ? d.corridor.rig().T_camera_left[1] : knocked[1], i);
  }
}

auto points_of(const Drive& d, PointStage stage) {
  const auto& points = d.odometry.map().points();
  return std::count_if(points.begin(), points.end(),
                       [stage](const MapPoint& p) { return p.stage == stage; });
}

TEST(OdometryUnlinked, relinkingKeepsThePathContinuous) {
  Drive d(false);
  Transform before;
  for (int i = 0; i < 10; ++i) {
    const FrameOutcome out = d.odometry.process(d.corridor.frame(i));
    ASSERT_TRUE(i == 0 || out.posed) << i;
    before = out.T_left_world;
  }
  d.odometry.link(d.corridor.rig());
  EXPECT_EQ(d.odometry.linked(), Link::unlinked) << "from the next frame on";
  for (int i = 10; i < 20; ++i) {
    FrameOutcome out = d.odometry.process(d.corridor.frame(i));
    EXPECT_EQ(out.relink_due, i == 10) << i;
    d.odometry.rebuild(&out);
    ASSERT_TRUE(out.posed) << i;
    EXPECT_FALSE(out.restarted) << i;
    EXPECT_TRUE(i > 10 || (out.keyframe && points_of(d, PointStage::candidate) > 0)) << i;
    EXPECT_EQ(d.odometry.linked(), Link::linked);
    EXPECT_LT((d.odometry.rig().T_camera_left[1].t - d.corridor.rig().T_camera_left[1].t).norm(),
              1e-6)
        << i;
    expect_pose(out, i);
    const Transform step = out.T_left_world * before.inverse();
    EXPECT_LT(
        (step.centre() - (Corridor::T_world_left(i - 1).inverse() * Corridor::T_world_left(i)).t)
            .norm(),
        kShift)
        << i;
    if (i > 11) {
      EXPECT_EQ(out.status, PoseStatus::ok) << i << ' ' << to_string(out.reason);
    }
    before = out.T_left_world;
  }
}

TEST(OdometryUnlinked, thirdCameraIsFoundFromTheMap) {
  Drive d(false, 3);
  for (int i = 0; i < 16; ++i) {
    const FrameOutcome out = d.odometry.process(d.corridor.frame(i));
    ASSERT_TRUE(i == 0 || out.posed) << i;
  }
  for (const int k : {1, 2})
    expect_rig(d.odometry, k, d.corridor.rig().T_camera_left[static_cast<std::size_t>(k)], 15);
}

}  // namespace
}  // namespace vergence::odometry
