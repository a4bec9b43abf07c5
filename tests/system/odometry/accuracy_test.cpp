#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

#include "core/camera/camera.hpp"
#include "core/math/so3.hpp"
#include "tests/system/odometry/estimator_run.hpp"

namespace vergence::test {
namespace {

/// Every frame is usable, and none has an error beyond the bound of an `ok` pose.
void expect_usable(const StereoDrive& drive, const EstimatorRun& run) {
  EXPECT_EQ(count_usable(run.results(), 0, drive.size()), static_cast<int>(drive.size()))
      << run.describe();
  EXPECT_EQ(false_ok(run.results()), "");
}

TEST(OdometryAccuracy, driveIsOkAndWithinFourPerMille) {
  // One pair measures a point 15 m away (27 px of disparity) to 15 m · 0.15 · √2 px / 27 px =
  // 0.12 m, a hundred of them the step's path to 12 mm; a keyframe hands that on every metre or so,
  // and the window ties five to ten of them together: 10 m come to some 20 to 40 mm, 0.2 to 0.4 %.
  // A fault of scale, of the lens model or of the rig's transform would show as a per cent and
  // more.
  constexpr double kShare = 0.004;
  // rad/m: a hundred directions of 0.15 px / 550 px each, per keyframe, over 10 m; ten times that.
  constexpr double kTurnPerMetre = 0.0005;
  EstimatorRun run(with_supplied(brief_drive().rig));
  run.process(brief_drive());
  expect_usable(brief_drive(), run);
  const TrajectoryEvaluation e = evaluate_results(run.results(), {10, 20, 30, 40});
  ASSERT_EQ(e.status, EvaluationStatus::ok);
  EXPECT_GT(e.path_reference, 50.0);
  EXPECT_GT(e.segments[0].count, 200U);
  EXPECT_LT(e.segments[0].translation, kShare);
  EXPECT_LT(e.segments[0].rotation, kTurnPerMetre);
  EXPECT_LT(e.end_error_ratio, kShare);
  EXPECT_NEAR(e.sim3.scale, 1.0, kShare);
}

TEST(OdometryAccuracy, standingRigDoesNotMove) {
  RenderedDriveOptions options = brief_options(distorted_rig(), 0);
  options.drive.kind = mock::DriveKind::still;
  const StereoDrive still = render(options, 60);
  EstimatorRun run(with_supplied(still.rig));
  run.process(still);
  expect_usable(still, run);
  double furthest = 0, turned = 0;
  for (const FrameResult& r : run.results()) {
    const MotionError e = motion_error(run.results().front(), r);
    furthest = std::max(furthest, e.translation);
    turned = std::max(turned, e.rotation);
  }
  // All frames are measured against the same keyframe: the noise of one frame, a hundred points of
  // 15 m and 0.15 px, four sigmas.
  EXPECT_LT(furthest, 0.012);
  EXPECT_LT(turned, 4 * 0.15 / 550 / 10);
}

/// 120° across, 150° from corner to corner: pinhole-equidistant lenses.
RigCalibration fisheye_rig() {
  RigCalibration rig = distorted_rig();
  for (Intrinsics& c : rig.intrinsics) {
    c.kind = CameraModelKind::pinhole_equidistant;
    c.fx = c.fy = 305.0;
    c.distortion = {0.0034, 0.0008, -0.0002, 0.00002, 0};
  }
  return rig;
}

const StereoDrive& fisheye_drive() {
  static const StereoDrive drive = render(brief_options(fisheye_rig(), 1.5), 200);
  return drive;
}

TEST(FisheyeRig, driveIsOkAndWithinOnePercent) {
  const StereoDrive& drive = fisheye_drive();
  // The image's edge is where it is meant to be: 60° from the axis at half the width, but for the
  // distortion.
  Vec3 ray;
  ASSERT_TRUE(Camera(drive.rig.intrinsics[0]).unproject(Vec2(639, 241), &ray));
  ASSERT_NEAR(std::atan(ray.x()) * 180 / std::numbers::pi, 60, 1.0);

  EstimatorRun run(with_supplied(drive.rig));
  run.process(drive);
  expect_usable(drive, run);
  const TrajectoryEvaluation e = evaluate_results(run.results(), {10, 20, 30});
  ASSERT_EQ(e.status, EvaluationStatus::ok);
  ASSERT_GT(e.path_reference, 40.0);
  // A pixel is 1.8 times the angle that it is with lenses of 550 px, and so is every error of depth
  // and path.
  EXPECT_LT(e.segments[0].translation, 0.0075);
  EXPECT_LT(e.segments[0].rotation, 0.001);
  EXPECT_NEAR(e.sim3.scale, 1.0, 0.0075);
}

TEST(FisheyeRig, extrinsicsAreFoundFromTheDrive) {
  const StereoDrive& drive = fisheye_drive();
  EstimatorRunOptions options = from_scratch(drive.rig);
  options.options.calibration = {};
  EstimatorRun run(options);
  run.process(drive);
  run.finish();
  ASSERT_TRUE(run.estimator().calibrated()) << run.describe();
  const Transform &found = run.estimator().calibration().T_camera_left[1],
                  &real = drive.rig.T_camera_left[1];
  const Vec3 turn = log_so3(found.R * real.R.transpose());
  // Three of the sigmas below which a calibration is accepted: 0.15 mrad an axis, 4 mm along y and
  // along z.
  EXPECT_LT(turn.cwiseAbs().maxCoeff(), 3 * 0.15e-3);
  EXPECT_LT((found.t - real.t).cwiseAbs().maxCoeff(), 3 * 0.004);
  const auto posed =
      std::count_if(run.results().begin(), run.results().end(),
                    [](const FrameResult& r) { return r.sample.status != PoseStatus::lost; });
  EXPECT_GT(posed, static_cast<int>(drive.size()) * 9 / 10);
}

}  // namespace
}  // namespace vergence::test
