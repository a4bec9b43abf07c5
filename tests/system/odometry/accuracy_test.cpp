#include <gtest/gtest.h>

#include <algorithm>

#include "core/comparison/trajectory_metrics.hpp"
#include "tests/system/odometry/mock_drive.hpp"

namespace vergence::test {
namespace {

struct Trajectories {
  std::vector<StampedPose> estimate, truth;
};

Trajectories trajectories(const std::vector<Answer>& answers) {
  Trajectories t;
  for (const Answer& a : answers) {
    if (a.sample.status == PoseStatus::lost) continue;
    t.estimate.push_back({a.sample.stamp, a.sample.T_world_left});
    t.truth.push_back({a.sample.stamp, a.T_reference_left});
  }
  return t;
}

// One pair measures a point 15 m away (27 px of disparity) to 15 m · 0.15 · √2 px / 27 px = 0.12 m,
// a hundred of them the step's way to 12 mm; a keyframe hands that on every metre or so, and the
// window ties five to ten of them together: 10 m come to some 20 to 40 mm, 0.2 to 0.4 %. A fault of
// scale, of the lens model or of the rig's transform would show as a per cent and more.
constexpr double kSegmentError = 0.004, kEndError = 0.004;
constexpr double kTurnPerMetre = 0.0005;  // rad: a hundred directions of 0.15 px / 550 px each, per
                                          // keyframe, over 10 m; ten times that

TEST(OdometryOnTheMockDrive, isOkAllTheWayAndWithinFourPerMilleOfIt) {
  const Replay r = replay(brief_drive());
  EXPECT_EQ(count_ok(r.answers, 0, brief_drive().size()), static_cast<int>(brief_drive().size()))
      << story(r.answers);
  EXPECT_EQ(wrong_ok(r.answers, {}), "");
  const Trajectories t = trajectories(r.answers);
  EvaluationOptions options;
  options.segments = {{{10, 20, 30, 40}, 1, false}};
  const TrajectoryEvaluation e = evaluate(t.estimate, t.truth, options);
  ASSERT_EQ(e.status, EvaluationStatus::ok);
  EXPECT_GT(e.path_reference, 50.0);
  EXPECT_GT(e.segments[0].count, 200U);
  EXPECT_LT(e.segments[0].translation, kSegmentError);
  EXPECT_LT(e.segments[0].rotation, kTurnPerMetre);
  EXPECT_LT(e.end_error_ratio, kEndError);
  EXPECT_NEAR(e.sim3.scale, 1.0, kSegmentError);
}

TEST(OdometryOnTheMockDrive, standingStillItStays) {
  const Replay r = replay(still_drive());
  EXPECT_EQ(count_ok(r.answers, 0, still_drive().size()), static_cast<int>(still_drive().size()))
      << story(r.answers);
  double furthest = 0, turned = 0;
  for (const Answer& a : r.answers) {
    const MotionError e = motion_error(r.answers.front(), a);
    furthest = std::max(furthest, e.translation);
    turned = std::max(turned, e.rotation);
  }
  // All frames are measured against the same keyframe: the noise of one frame, a hundred points of
  // 15 m and 0.15 px, four sigmas.
  EXPECT_LT(furthest, 0.012);
  EXPECT_LT(turned, 4 * 0.15 / 550 / 10);
}

}  // namespace
}  // namespace vergence::test
