// From nothing but the baseline's length, on the paper's rig. One program: the cases share what is
// rendered.
#include <gtest/gtest.h>

#include <cmath>

#include "core/calibration/gates.hpp"
#include "tests/system/odometry/estimator_run.hpp"

namespace vergence::test {
namespace {

/// Number of frames that a calibration is found from.
constexpr int kFrames = 60;
/// The drives are at least this fast in m/s for this time.
constexpr double kSpeed = 3.0, kSeconds = 5.0;
// The largest errors allowed from 60 frames.
/// Rotation in rad, t_y in m and t_z in m.
constexpr double kRotation = 0.15e-3, kAcross = 1.8e-3, kAlong = 4.5e-3;

std::vector<double> starts(int count = 3) {
  return RenderedDrive::starts({}, count, kSpeed, kSeconds);
}

RenderedDriveOptions drive_from(double seconds) {
  RenderedDriveOptions o;
  o.from_s = seconds;
  return o;
}

/// Rendered once a process.
const StereoDrive& street() {
  static const StereoDrive drive = render(drive_from(starts()[0]), 110);
  return drive;
}

EstimatorRunOptions from_sixty(const RigCalibration& rig) {
  EstimatorRunOptions s = from_scratch(rig);
  s.options.calibration.min_frames = s.options.calibration.max_frames = kFrames;
  return s;
}

void expect_found(const EstimatorRun& run, const Transform& truth) {
  const CalibrationDecision* d = run.accepted();
  ASSERT_NE(d, nullptr) << run.describe();
  const RigError e = rig_error(d->calibration, 1, truth);
  EXPECT_LT(e.rotation, kRotation) << to_string(e);
  EXPECT_LT(std::abs(e.t.y()), kAcross) << to_string(e);
  EXPECT_LT(std::abs(e.t.z()), kAlong) << to_string(e);
  EXPECT_NEAR(d->calibration.T_camera_left[1].t.norm(), truth.t.norm(), 1e-12)
      << "the length is known";
  // Six numbers whose sigmas hold up: beyond four in one of them is one case in three thousand.
  EXPECT_LT(e.sigmas, 4.0) << to_string(e);
  EXPECT_EQ(d->calibration.frames, kFrames);
  EXPECT_EQ(run.estimator().state(), State::stereo_odometry);
  EXPECT_TRUE(run.estimator().calibrated());
}

/// Every frame once the first pair is found has a pose, and none without a calibration is called
/// ok.
void expect_poses_all_the_time(const EstimatorRun& run) {
  bool any = false;
  for (const FrameResult& a : run.results()) {
    if (any) {
      EXPECT_NE(a.sample.status, PoseStatus::lost) << run.describe();
    }
    any = any || a.sample.status != PoseStatus::lost;
    if (a.sample.state == State::parallel_monocular || a.sample.state == State::calibrating) {
      EXPECT_NE(a.sample.status, PoseStatus::ok) << run.describe();
    }
  }
  EXPECT_EQ(false_ok(run.results()), "") << run.describe();
  EXPECT_GT(count_usable(run.results(), 0, 1000), 0) << run.describe();
}

TEST(FromScratch, transformIsFoundAtTwentyPlaces) {
  const Transform truth = paper_rig().T_camera_left[1];
  // Sums for the rotation, t_y and t_z.
  Vec3 squares = Vec3::Zero();
  const std::vector<double> places = starts(20);
  for (const double start : places) {
    SCOPED_TRACE(start);
    const RenderedDriveOptions options = drive_from(start);
    RenderedDrive drive(options);
    EstimatorRun run(from_sixty(options.rig));
    for (std::uint64_t i = 0; i < 110; ++i) run.process(drive.frame(i), drive.T_enu_left(i));
    expect_found(run, truth);
    expect_poses_all_the_time(run);
    ASSERT_NE(run.accepted(), nullptr);
    const RigError e = rig_error(run.accepted()->calibration, 1, truth);
    squares += Vec3(e.rotation, e.t.y(), e.t.z()).cwiseAbs2();
  }
  const Vec3 rms = (squares / static_cast<double>(places.size())).cwiseSqrt();
  EXPECT_LT(rms.x(), 0.06e-3);
  EXPECT_LT(rms.y(), 0.6e-3);
  EXPECT_LT(rms.z(), 1.8e-3);
}

TEST(FromScratch, noThreadAllocatesAtRuntime) {
  for (const int threads : {1, 2}) {
    EstimatorRunOptions s = from_scratch(street().rig);
    s.threads = threads;
    EstimatorRun run(s);
    run.process(street(), 0, 75);
    EXPECT_FALSE(run.decisions().empty()) << "the solver's share has to be in it\n"
                                          << run.describe();
    EXPECT_EQ(run.allocations(), 0U) << threads;
  }
}

/// The right camera's image is the one of the frame before.
bool one_late(std::size_t i, RigFrame* frame) {
  if (i == 0) return false;
  frame->images[1] = street().pairs[i - 1][1].view();
  return true;
}

TEST(FromScratch, cameraOneFrameLateFromTheStartIsRejected) {
  EstimatorRun run(from_scratch(street().rig));
  run.process(street(), 0, street().size(), one_late);
  run.finish();
  EXPECT_EQ(run.count_accepted(), 0) << run.describe();
  EXPECT_TRUE(run.rejected_for(calibration::reason(calibration::Gate::out_of_sync)) ||
              run.rejected_for(calibration::reason(calibration::Gate::implausible_direction)))
      << run.describe();
  EXPECT_EQ(false_ok(run.results()), "") << run.describe();
  EXPECT_EQ(count_usable(run.results(), 0, street().size()), 0) << run.describe();
}

TEST(StandingStill, standingRigNeedsMotionAndAdoptsNothing) {
  RenderedDriveOptions options;
  options.drive.kind = mock::DriveKind::still;
  options.from_s = 3;
  const StereoDrive still = render(options, 60);
  EstimatorRun run(from_scratch(still.rig));
  run.process(still, 0, still.size());
  EXPECT_EQ(run.count_accepted(), 0) << run.describe();
  EXPECT_FALSE(run.estimator().calibrated());
  for (const FrameResult& a : run.results()) {
    EXPECT_NE(a.sample.status, PoseStatus::ok) << run.describe();
    if (a.sample.frame >= 30) {
      EXPECT_EQ(a.sample.reason, Reason::needs_motion) << "frame " << a.sample.frame << '\n'
                                                       << run.describe();
    }
  }
  EXPECT_NE(run.first(EstimatorEvent::Kind::calibration_pending), nullptr) << run.describe();
  run.finish();
  EXPECT_EQ(run.count_accepted(), 0) << run.describe();
}

TEST(ThreeCameras, bothTransformsOfThreeCamerasAreFound) {
  RigCalibration rig{.cameras = 3};
  for (int k = 0; k < 3; ++k) {
    Intrinsics& c = rig.intrinsics[static_cast<std::size_t>(k)];
    c.width = 640, c.height = 480, c.fx = c.fy = 550, c.cx = 319 + 2 * k, c.cy = 240 - k;
    c.distortion = {-0.08, 0.02, 0, 0, 0};
  }
  rig.T_camera_left[1] = {exp_so3({0.003, -0.004, 0.002}), {-0.75, 0.004, -0.003}};
  rig.T_camera_left[2] = {exp_so3({-0.002, 0.005, -0.003}), {-0.25, -0.06, 0.01}};
  rig.baseline = rig.T_camera_left[1].t.norm();
  RenderedDriveOptions options = drive_from(starts()[0]);
  options.rig = rig;
  RenderedDrive drive(options);
  EstimatorRunOptions setting = from_sixty(rig);
  // The nominal position is a rough measurement.
  setting.nominal.T_camera_left[2] = {Mat3::Identity(), {-0.25, -0.05, 0}};
  EstimatorRun run(setting);
  // Pixels twice as wide as the paper's: the sigmas that are enough are as much larger.
  for (std::uint64_t i = 0; i < 110 && run.accepted() == nullptr; ++i)
    run.process(drive.frame(i), drive.T_enu_left(i));
  ASSERT_NE(run.accepted(), nullptr) << run.describe();
  const RigCalibration& found = run.accepted()->calibration;
  for (int k = 1; k < 3; ++k) {
    const RigError e = rig_error(found, k, rig.T_camera_left[static_cast<std::size_t>(k)]);
    EXPECT_LT(e.sigmas, 4.0) << k << ' ' << to_string(e);
    EXPECT_LT(e.rotation, 1247.0 / 550.0 * kRotation) << k << ' ' << to_string(e);
    EXPECT_LT(std::abs(e.t.y()), 1247.0 / 550.0 * kAcross) << k << ' ' << to_string(e);
    EXPECT_LT(std::abs(e.t.z()), 1247.0 / 550.0 * kAlong) << k << ' ' << to_string(e);
  }
  EXPECT_NEAR(found.T_camera_left[1].t.norm(), rig.baseline, 1e-12);
}

}  // namespace
}  // namespace vergence::test
