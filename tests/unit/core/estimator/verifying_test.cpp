// A calibration that is handed over is a claim: the drive confirms it, or shows that it is off and
// measures its own.
#include <gtest/gtest.h>

#include <limits>

#include "tests/unit/core/estimator/corridor_drive.hpp"

namespace vergence {
namespace {

using Kind = EstimatorEvent::Kind;

/// The corridor's rig, driven with a claim about it.
struct SuppliedRig : test::CorridorDrive {
  // First frame without images and first frame with images again.
  int dark_from = -1, dark_to = -1;
  // The corridor has an end: after so many frames the same way back, and forth again.
  int turn_after = 120;
  // Steps of 0.15 m from frame to frame.
  int steps = 1;

  /// `knock_at`: from this frame on the rig is turned by `knock`.
  void drive(int last, int knock_at = -1, const Vec3& knock = Vec3::Zero()) {
    begin();
    for (int i = 0; i < last; ++i) {
      auto T_camera_left = corridor.rig().T_camera_left;
      if (knock_at >= 0 && i >= knock_at) T_camera_left[1].R = exp_so3(knock) * T_camera_left[1].R;
      const int lap = i % (2 * turn_after), place = std::min(lap, 2 * turn_after - lap);
      RigFrame frame = corridor.frame_at(i, steps * place, T_camera_left);
      if (i >= dark_from && i < dark_to) frame.images = {};
      give(frame);
    }
  }
  /// The poses of frames in [from, to) are all `ok`, or none of them is.
  void expect_ok(bool ok, int from, int to = std::numeric_limits<int>::max()) const {
    for (const PoseSample& s : samples)
      if (const int i = static_cast<int>(s.frame); i >= from && i < to) {
        EXPECT_EQ(s.status == PoseStatus::ok, ok) << i << '\n' << story;
      }
  }
  /// By what the calibration in use turns what is straight ahead, rad: yaw and centre together.
  [[nodiscard]] double turn_from(const Mat3& truth) const {
    const RigCalibration& found = estimator->calibration();
    const double yaw = log_so3(found.T_camera_left[1].R * truth.transpose()).y();
    const Intrinsics &lens = found.intrinsics[1], &true_lens = corridor.rig().intrinsics[1];
    return yaw + (lens.cx - true_lens.cx) / true_lens.fx;
  }
};

// Inverse depth is off by Z ψ / b: at the depth where a match of 0.15 px is 1 % (6.6 m) the
// tolerated 2 % are a yaw of 1.5 mrad. The claims below are none and 15 mrad (20 %) off.
TEST(Verifying, trueCalibrationIsDegradedUntilVerified) {
  SuppliedRig c;
  c.drive(60);
  const int confirmed = c.first(Kind::calibration_verified);
  // The solve has 19 frames, and six more are held out.
  ASSERT_GE(confirmed, 24) << c.story;
  EXPECT_EQ(c.first(Kind::calibration_contradicted), -1) << c.story;
  EXPECT_EQ(c.first(Kind::rig_changed), -1) << c.story;
  EXPECT_EQ(c.first(Kind::focal_length_contradicted), -1) << c.story;
  for (int i = 0; i < confirmed; ++i) {
    const PoseSample& s = c.samples[static_cast<std::size_t>(i)];
    EXPECT_EQ(s.status, PoseStatus::degraded) << i;
    EXPECT_EQ(s.reason, Reason::unverified_calibration) << i;
  }
  c.expect_ok(true, confirmed);
  EXPECT_TRUE(c.estimator->verified());
}

TEST(Verifying, outageNeedsOneNewVerification) {
  SuppliedRig c;
  c.dark_from = 50, c.dark_to = 56;
  c.drive(110);
  ASSERT_GE(c.first(Kind::calibration_verified), 24) << c.story;
  const int again = c.first(Kind::calibration_verified, c.dark_to);
  ASSERT_GE(again, c.dark_to + 24) << c.story;
  EXPECT_EQ(c.first(Kind::calibration_verified, again + 1), -1) << c.story;
  EXPECT_EQ(c.first(Kind::rig_changed), -1) << c.story;
  c.expect_ok(false, c.dark_to, again);
  c.expect_ok(true, again);
}

// The tolerated 2 % of the depth at which the corridor is judged are a yaw of 1.5 mrad: this one is
// 20 %, and no frame shows it to whom the frames before it are unknown.
TEST(Verifying, yawKnockDuringOutageIsNeverOk) {
  SuppliedRig c;
  c.dark_from = 50, c.dark_to = 56;
  c.drive(110, 53, Vec3(0, 0.015, 0));
  const int adopted = c.first(Kind::calibration_accepted, c.dark_to);
  ASSERT_GE(adopted, 0) << c.story;
  c.expect_ok(false, c.dark_to, adopted);
  EXPECT_GE(std::max(c.first(Kind::calibration_contradicted, c.dark_to),
                     c.first(Kind::rig_changed, c.dark_to)),
            c.dark_to)
      << c.story;
  EXPECT_TRUE(c.estimator->verified()) << c.story;
}

// A full segment's result is the prior of later solves, but must not be after the rig has changed.
void expect_mended_once(double yaw_rad) {
  SCOPED_TRACE(yaw_rad);
  // The knock is after the first full segment.
  constexpr int kKnock = 80;
  const Vec3 knock(0, yaw_rad, 0);
  SuppliedRig c;
  c.options.calibration.max_frames = 60;
  c.drive(200, kKnock, knock);
  const int adopted = c.first(Kind::calibration_accepted, kKnock);
  ASSERT_GE(adopted, kKnock) << c.story;
  EXPECT_EQ(c.first(Kind::calibration_contradicted, adopted + 1), -1) << c.story;
  EXPECT_EQ(c.first(Kind::rig_changed, adopted + 1), -1) << c.story;
  EXPECT_EQ(c.samples.back().status, PoseStatus::ok) << c.story;
  const Mat3 truth = exp_so3(knock) * c.corridor.rig().T_camera_left[1].R;
  EXPECT_NEAR(c.turn_from(truth), 0, 1.5e-3) << "the tolerated 2 %\n" << c.story;
  c.expect_ok(false, kKnock, adopted);
}

TEST(Verifying, yawKnockIsRecalibratedOnce) {
  expect_mended_once(0.015);
  // A rotation just large enough to be detected at once.
  expect_mended_once(0.004);
}

TEST(Verifying, wrongYawIsContradictedAndReplaced) {
  SuppliedRig c;
  const Transform truth = c.given.T_camera_left[1];
  c.given.T_camera_left[1].R = exp_so3({0, 0.015, 0}) * truth.R;
  c.drive(70);
  const int contradicted = c.first(Kind::calibration_contradicted),
            accepted = c.first(Kind::calibration_accepted);
  ASSERT_GE(contradicted, 0) << c.story;
  ASSERT_GE(accepted, contradicted) << c.story;
  const int verified = c.first(Kind::calibration_verified);
  ASSERT_EQ(verified, accepted + 1) << c.story;
  for (const PoseSample& s : c.samples)
    EXPECT_NE(s.status, PoseStatus::lost) << s.frame << '\n' << c.story;
  // The poses of the frame of the adoption and of the next still are those of the contradicted rig.
  // The first pose after them has what a fifth of all depths left in the window to correct.
  c.expect_ok(false, 0, verified + 1);
  c.expect_ok(true, verified + 2);
  // Where it is judged (6.6 m) 15 mrad are 20 % of the inverse depth, known to a tenth: 2 % is what
  // the drive's own may be off.
  const auto first = std::find_if(c.decisions.begin(), c.decisions.end(),
                                  [](const CalibrationDecision& d) { return d.accepted; });
  ASSERT_NE(first, c.decisions.end());
  EXPECT_EQ(first->cause, CalibrationCause::contradicted);
  EXPECT_TRUE(first->is_refinement);
  const double off = 100 * first->reference_depth_m * 0.015 / c.given.T_camera_left[1].t.norm();
  EXPECT_NEAR(first->depth_error_percent, off, 0.1 * off + 2);
  EXPECT_TRUE(c.estimator->verified()) << c.story;
  // Straight ahead at 6.6 m, yaw and centre together: within the tolerance twice over of what the
  // truth gives.
  EXPECT_NEAR(c.turn_from(truth.R), 0, 3e-3) << c.story;
}

// 3 mrad of yaw are 4 % of the depth at which the calibration is judged (6.6 m): more than is
// tolerated, but of a size that the rig's own may have. What the drive finds is better, because it
// has no pitch, and the map's depths are the former ones until it is rebuilt.
TEST(Verifying, posesWaitForTheMapAfterADepthRefinement) {
  SuppliedRig c;
  c.given.T_camera_left[1].R = exp_so3({0.002, 0.003, 0}) * c.given.T_camera_left[1].R;
  c.drive(40);
  ASSERT_FALSE(c.decisions.empty());
  const CalibrationDecision& found = c.decisions.front();
  ASSERT_TRUE(found.accepted && found.cause == CalibrationCause::refinement) << c.story;
  ASSERT_GT(found.depth_error_percent, c.options.calibration.max_depth_error_percent);
  const int adopted = c.first(Kind::calibration_accepted),
            applied = c.first(Kind::calibration_applied);
  ASSERT_GT(applied, adopted) << c.story;
  c.expect_ok(false, adopted, applied + 1);
  c.expect_ok(true, applied + 1);
}

// A calibration without sigmas is a maker's. Seven frames leave the length along the optical axis
// open: without the prior it is displaced by 7 mm, with it by half of that.
TEST(Verifying, suppliedCalibrationIsAPriorOfTheFirstSolve) {
  SuppliedRig c;
  c.options.calibration.min_frames = 12;
  c.begin();
  for (int i = 0; i < 20 && c.decisions.empty(); ++i) c.give(c.corridor.frame_at(i, 0.5 * i));
  ASSERT_FALSE(c.decisions.empty());
  EXPECT_FALSE(c.decisions.front().accepted) << c.story;
  const double z = c.decisions.front().calibration.T_camera_left[1].t.z();
  EXPECT_NEAR(z, c.given.T_camera_left[1].t.z(), 5e-3);
}

// At the turn the prediction is off by 0.9 m; a motion model that goes on forwards is a knock here.
TEST(Verifying, wayThereAndBackKeepsTheMapAndIsNoKnock) {
  SuppliedRig c;
  c.turn_after = 28, c.steps = 3;
  c.drive(2 * c.turn_after);
  for (const Kind kind : {Kind::map_reset, Kind::relocalised, Kind::rig_changed})
    EXPECT_EQ(c.count(kind), 0) << c.story;
  c.expect_ok(true, c.first(Kind::calibration_verified));
  // The last frame is three steps from the first one, after 25 m.
  EXPECT_NEAR(c.samples.back().T_world_left.t.norm(), 0.45, 0.03);
}

// While the calibration is a claim, epipolar lines cannot say whether a yaw is new; disparities
// that move all at once can. 10 mrad are 2.8 px here.
TEST(Verifying, yawKnockBeforeVerificationIsDetected) {
  // The knock is after the first snapshot and before its decision.
  constexpr int kKnock = 22;
  SuppliedRig c;
  c.drive(45, kKnock, {0, 0.01, 0});
  const int noticed = c.first(Kind::rig_changed);
  ASSERT_GE(noticed, kKnock) << c.story;
  EXPECT_LE(noticed, kKnock + 1) << c.story;
  c.expect_ok(false, 0);
}

// For five frames after a calibration was adopted the monitor tells no knock; a pose is not `ok`
// from the knock's first frame on all the same. 5 mrad of pitch are 1.4 px across the epipolar
// lines.
TEST(Verifying, pitchKnockAfterAdoptionIsNeverOk) {
  constexpr int kVerified = 25, kKnock = kVerified + 3;
  const Transform truth = odometry::test::Corridor().rig().T_camera_left[1];
  SuppliedRig c;
  c.given.T_camera_left[1].R = exp_so3({0, 0.015, 0}) * truth.R;
  c.drive(kVerified + 9, kKnock, {0.005, 0, 0});
  ASSERT_EQ(c.first(Kind::calibration_verified), kVerified) << c.story;
  EXPECT_EQ(c.first(Kind::rig_changed), kVerified + 6) << c.story;
  c.expect_ok(false, 0, kVerified + 1);
  c.expect_ok(true, kVerified + 1, kKnock);
  c.expect_ok(false, kKnock);
}

}  // namespace
}  // namespace vergence
