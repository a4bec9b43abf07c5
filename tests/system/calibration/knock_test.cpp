#include <gtest/gtest.h>

#include <cmath>

#include "core/math/se3.hpp"
#include "tests/system/odometry/estimator_run.hpp"

namespace vergence::test {
namespace {

// Frames: rendered once for all knocks; 3 s to recalibrate; odometry with the new calibration.
constexpr std::uint64_t kShared = 60, kRecalibrate = 90, kAfter = 20;

/// A change of the right camera while the rig drives with its true calibration.
struct Knock {
  const char* name;
  Vec3 turn_deg, shift_mm;
  /// Maximum number of frames until detection.
  int frames;
  // False: no matches across are left, so that the left camera continues alone for a while with the
  // scale as it was.
  bool matches = true;
  // The frame; the monitor has a reference of its own from about 90 on.
  std::uint64_t at = 60;
};

RenderedDriveOptions drive_options() {
  RenderedDriveOptions o;
  o.from_s = 20;
  return o;
}

/// The drive until the knock, rendered once a process.
const StereoDrive& before_knocks() {
  static const StereoDrive drive = render(drive_options(), kShared);
  return drive;
}

/// T_camera_left of the right camera after the knock. The length is unchanged: images do not show
/// it.
Transform knocked(const Transform& before, const Knock& knock) {
  Transform after =
      perturbed(before, knock.turn_deg * std::numbers::pi / 180, 1e-3 * knock.shift_mm);
  after.t *= before.t.norm() / after.t.norm();
  return after;
}

class Knocks : public testing::TestWithParam<Knock> {};

TEST_P(Knocks, isDetectedAndRecalibratedWithoutFalseOk) {
  const Knock& knock = GetParam();
  RenderedDriveOptions options = drive_options();
  const Transform after = knocked(options.rig.T_camera_left[1], knock);
  EstimatorRun run(with_calibration(options.rig));
  run.process(before_knocks(), 0, kShared);
  const Transform before = options.rig.T_camera_left[1];
  options.placed = [&](int, std::uint64_t i) { return i < knock.at ? before : after; };
  RenderedDrive drive(options);
  for (std::uint64_t i = kShared; i < knock.at; ++i)
    run.process(drive.frame(i), drive.T_enu_left(i));
  ASSERT_EQ(count_usable(run.results(), 0, knock.at), static_cast<int>(knock.at)) << run.describe();

  const std::uint64_t latest = knock.at + static_cast<std::uint64_t>(knock.frames) + kRecalibrate;
  std::uint64_t end = latest, i = knock.at;
  for (; i < end; ++i) {
    run.process(drive.frame(i), drive.T_enu_left(i));
    if (end == latest && run.accepted() != nullptr) end = i + 1 + kAfter;
  }
  const TimedEvent* detected = run.first(EstimatorEvent::Kind::rig_changed);
  ASSERT_NE(detected, nullptr) << run.describe();
  EXPECT_GE(detected->frame, knock.at) << run.describe();
  EXPECT_LE(detected->frame, knock.at + static_cast<std::uint64_t>(knock.frames)) << run.describe();
  ASSERT_EQ(run.count_accepted(), 1) << run.describe();
  const TimedDecision& recalibrated = run.decisions().back();
  EXPECT_LE(recalibrated.frame, detected->frame + kRecalibrate) << run.describe();
  for (const FrameResult& a : run.results())
    EXPECT_NE(a.sample.status, PoseStatus::lost) << "frame " << a.sample.frame;
  if (knock.matches) {
    EXPECT_EQ(false_ok(run.results()), "") << run.describe();
  } else {
    // The path driven without a measured scale remains: right before, and right after.
    const auto after_recalibration =
        run.results().begin() + static_cast<std::ptrdiff_t>(recalibrated.frame);
    EXPECT_EQ(false_ok({run.results().begin(), after_recalibration}), "") << run.describe();
    EXPECT_EQ(false_ok({after_recalibration, run.results().end()}), "") << run.describe();
  }

  // Found from 25 frames or more.
  const RigError e = rig_error(recalibrated.decision.calibration, 1, after);
  EXPECT_LT(e.rotation, 0.25e-3) << to_string(e);
  EXPECT_LT(std::abs(e.t.y()), 2.5e-3) << to_string(e);
  EXPECT_LT(std::abs(e.t.z()), 8e-3) << to_string(e);
  EXPECT_EQ(run.estimator().state(), State::stereo_odometry) << run.describe();

  // The odometry with it: between the last two dozen frames as accurate as before the knock.
  const FrameResult &last = run.results().back(),
                    &first = run.results()[run.results().size() - kAfter / 2];
  const MotionError drift = motion_error(first, last);
  const double path = (last.T_reference_left.t - first.T_reference_left.t).norm();
  EXPECT_LT(drift.translation, 0.02 + 0.005 * path) << run.describe();
  EXPECT_LT(drift.rotation, 1e-3);
}

INSTANTIATE_TEST_SUITE_P(All, Knocks,
                         testing::Values(Knock{"pitch 0.05 deg", {0.05, 0, 0}, {0, 0, 0}, 30},
                                         Knock{"pitch 0.2 deg", {0.2, 0, 0}, {0, 0, 0}, 10},
                                         Knock{"pitch 2 deg", {2, 0, 0}, {0, 0, 0}, 10, false},
                                         Knock{"yaw 0.3 deg", {0, 0.3, 0}, {0, 0, 0}, 30},
                                         Knock{
                                             "roll 0.1 deg", {0, 0, 0.1}, {0, 0, 0}, 30, true, 130},
                                         Knock{"t_y 4 mm", {0, 0, 0}, {0, 4, 0}, 60, true, 220}),
                         [](const auto& knock) {
                           std::string name = knock.param.name;
                           std::replace_if(
                               name.begin(), name.end(),
                               [](char c) { return c == ' ' || c == '.'; }, '_');
                           return name;
                         });

// 0.4 % of the depth is too little for the monitor. The first full segment of frames after it, 300
// to 450, shows it.
TEST(Knock, undetectableShiftAlongViewIsEstimated) {
  const Knock knock{"t_z 10 mm", {0, 0, 0}, {0, 0, 10}, 240, true, 220};
  RenderedDriveOptions options = drive_options();
  const Transform before = options.rig.T_camera_left[1], after = knocked(before, knock);
  EstimatorRun run(with_calibration(options.rig));
  run.process(before_knocks(), 0, kShared);
  options.placed = [&](int, std::uint64_t i) { return i < knock.at ? before : after; };
  RenderedDrive drive(options);
  for (std::uint64_t i = kShared; i < knock.at + static_cast<std::uint64_t>(knock.frames); ++i)
    run.process(drive.frame(i), drive.T_enu_left(i));
  const RigError e = rig_error(run.estimator().calibration(), 1, after);
  EXPECT_LT(std::abs(e.t.z()), 0.5e-3 * std::abs(knock.shift_mm.z())) << to_string(e);
  EXPECT_EQ(false_ok(run.results()), "") << run.describe();
  for (const FrameResult& a : run.results())
    EXPECT_NE(a.sample.status, PoseStatus::lost) << "frame " << a.sample.frame;
}

TEST(Knock, looseCameraIsReportedAndNeverOk) {
  RenderedDriveOptions options = drive_options();
  const Transform T = options.rig.T_camera_left[1];
  options.placed = [&](int, std::uint64_t i) {
    // Three milliradians about each axis, in periods that do not fit each other.
    const auto turn = [i](double period) {
      return 3e-3 * std::sin(2 * std::numbers::pi * static_cast<double>(i) / period);
    };
    return perturbed(T, {turn(23), turn(31), turn(17)}, Vec3::Zero());
  };
  RenderedDrive drive(options);
  EstimatorRun run(with_calibration(options.rig));
  for (std::uint64_t i = 0; i < 120; ++i) run.process(drive.frame(i), drive.T_enu_left(i));
  EXPECT_NE(run.first(EstimatorEvent::Kind::rig_not_rigid), nullptr) << run.describe();
  for (const FrameResult& a : run.results())
    EXPECT_NE(a.sample.status, PoseStatus::ok) << "frame " << a.sample.frame;
}

TEST(Knock, slowPitchDriftIsDetectedAndRecalibrated) {
  RenderedDriveOptions options;
  const Transform T = options.rig.T_camera_left[1];
  // Rate in rad/s.
  const double rate = 0.02 * (std::numbers::pi / 180) / 60;
  const auto pitched = [&](std::uint64_t i) {
    return rate * static_cast<double>(i) / options.rate;
  };
  options.placed = [&](int, std::uint64_t i) {
    return perturbed(T, {pitched(i), 0, 0}, Vec3::Zero());
  };
  options.from_s = 8;
  RenderedDrive drive(options);
  EstimatorRun run(with_calibration(options.rig));
  const auto frames =
      static_cast<std::uint64_t>(0.03 * (std::numbers::pi / 180) / rate * options.rate);
  std::uint64_t i = 0;
  for (; i < frames && run.first(EstimatorEvent::Kind::rig_changed) == nullptr; ++i)
    run.process(drive.frame(i), drive.T_enu_left(i));
  ASSERT_NE(run.first(EstimatorEvent::Kind::rig_changed), nullptr) << run.describe();
  for (const std::uint64_t end = i + 120; i < end && run.accepted() == nullptr; ++i)
    run.process(drive.frame(i), drive.T_enu_left(i));
  ASSERT_NE(run.accepted(), nullptr) << run.describe();
  const RigError e = rig_error(run.accepted()->calibration, 1, options.placed(1, i));
  EXPECT_LT(e.rotation, 0.25e-3) << to_string(e);
}

}  // namespace
}  // namespace vergence::test
