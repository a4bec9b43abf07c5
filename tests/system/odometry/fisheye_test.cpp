#include <gtest/gtest.h>

#include <numbers>

#include "core/camera/camera.hpp"
#include "core/comparison/trajectory_metrics.hpp"
#include "tests/system/odometry/mock_drive.hpp"

namespace vergence::test {
namespace {

constexpr double kDegrees = 180 / std::numbers::pi;

/// 120° across, 150° from corner to corner: pinhole-equidistant lenses, the right camera turned a
/// little.
RigCalibration fisheye_rig() {
  RigCalibration rig;
  rig.cameras = 2;
  rig.baseline = 0.75;
  for (std::size_t k = 0; k < 2; ++k) {
    Intrinsics& c = rig.intrinsics[k];
    c.kind = CameraModelKind::pinhole_equidistant;
    c.width = 640;
    c.height = 480;
    c.fx = c.fy = 305.0;
    c.cx = k == 0 ? 318.7 : 323.1;
    c.cy = k == 0 ? 241.2 : 237.9;
    c.distortion = {0.0034, 0.0008, -0.0002, 0.00002, 0};
  }
  rig.T_camera_left[1] = {exp_so3(Vec3(0.004, -0.006, 0.003)), Vec3(-0.75, 0.003, 0.005)};
  rig.baseline = rig.T_camera_left[1].t.norm();
  return rig;
}

const StereoDrive& fisheye_drive() {
  static const StereoDrive drive = [] {
    mock::DriveOptions options;
    options.kind = mock::DriveKind::brief;
    options.speed = 9.0;
    options.stop_s = 1.0;
    return render_drive(options, Duration::milliseconds(1500), 200, fisheye_rig());
  }();
  return drive;
}

TEST(FisheyeLenses, arePosedAllTheWayWithinOnePerCentOfIt) {
  const StereoDrive& drive = fisheye_drive();
  // The picture's edge is where it is meant to be: 60° from the axis at half the width, but for the
  // distortion.
  Vec3 ray;
  ASSERT_TRUE(Camera(drive.rig.intrinsics[0]).unproject(Vec2(639, 241), &ray));
  ASSERT_NEAR(std::atan(ray.x()) * kDegrees, 60, 1.0);
  const Replay r = replay(drive);
  EXPECT_EQ(count_ok(r.answers, 0, drive.size()), static_cast<int>(drive.size()))
      << story(r.answers);
  EXPECT_EQ(wrong_ok(r.answers, {}), "");
  std::vector<StampedPose> estimate, truth;
  for (const Answer& a : r.answers) {
    if (a.sample.status == PoseStatus::lost) continue;
    estimate.push_back({a.sample.stamp, a.sample.T_world_left});
    truth.push_back({a.sample.stamp, a.T_reference_left});
  }
  EvaluationOptions options;
  options.segments = {{{10, 20, 30}, 1, false}};
  const TrajectoryEvaluation e = evaluate(estimate, truth, options);
  ASSERT_EQ(e.status, EvaluationStatus::ok);
  ASSERT_GT(e.path_reference, 40.0);
  // As accuracy_test.cpp reckons for lenses of 550 px: a pixel is 1.8 times the angle here, and so
  // is every error of depth and way.
  EXPECT_LT(e.segments[0].translation, 0.0075);
  EXPECT_LT(e.segments[0].rotation, 0.001);
  EXPECT_NEAR(e.sim3.scale, 1.0, 0.0075);
}

TEST(FisheyeLenses, areCalibratedFromTheDriveItself) {
  const StereoDrive& drive = fisheye_drive();
  RigCalibration nominal = drive.rig;
  nominal.T_camera_left[1] = {Mat3::Identity(), Vec3(-drive.rig.baseline, 0, 0)};
  EstimatorOptions options;
  options.trust = CalibrationTrust::none;
  Arena arena(Estimator::memory_needed(options, nominal));
  SequentialRunner runner;
  ImmediateRunner solver;
  Estimator estimator(options, nominal, nominal, arena, runner, solver);
  int posed = 0;
  for (std::size_t i = 0; i < drive.size(); ++i) {
    RigFrame frame;
    frame.number = i;
    frame.stamp = drive.stamps[i];
    frame.cameras = 2;
    for (std::size_t k = 0; k < 2; ++k) frame.images[k] = drive.pairs[i][k].view();
    posed += estimator.process(frame).status != PoseStatus::lost ? 1 : 0;
  }
  estimator.finish();
  ASSERT_TRUE(estimator.calibrated());
  const Transform &found = estimator.calibration().T_camera_left[1],
                  &real = drive.rig.T_camera_left[1];
  const Vec3 turn = log_so3(found.R * real.R.transpose());
  // Three of the sigmas below which a calibration is taken: 0.15 mrad an axis, 4 mm along y and
  // along z.
  EXPECT_LT(turn.cwiseAbs().maxCoeff(), 3 * 0.15e-3);
  EXPECT_LT((found.t - real.t).cwiseAbs().maxCoeff(), 3 * 0.004);
  EXPECT_GT(posed, static_cast<int>(drive.size()) * 9 / 10);
}

}  // namespace
}  // namespace vergence::test
