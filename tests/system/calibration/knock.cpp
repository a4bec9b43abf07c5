#include "tests/system/calibration/knock.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace vergence::test {
namespace {

constexpr std::uint64_t
    kFilmed = 60,
    kMend = 90,
    kAfter = 20;  // frames: rendered once, 3 s to mend it, a look at the odometry afterwards

RenderedDriveOptions drive_options() {
  RenderedDriveOptions o;
  o.from_s = 20;
  return o;
}

/// The drive until the knock, rendered once a process.
const StereoDrive& before_knocks() {
  static const StereoDrive drive = film(drive_options(), kFilmed);
  return drive;
}

/// Where the right camera sits after it. The length is what it was: images do not tell it.
Transform knocked(const Transform& before, const Knock& knock) {
  Transform after =
      perturbed(before, knock.turn_deg * std::numbers::pi / 180, 1e-3 * knock.shift_mm);
  after.t *= before.t.norm() / after.t.norm();
  return after;
}

}  // namespace

void expect_taken_up(const Knock& knock) {
  SCOPED_TRACE(knock.name);
  RenderedDriveOptions options = drive_options();
  const Transform before = options.rig.T_camera_left[1], after = knocked(before, knock);
  Course course(with_calibration(options.rig));
  course.give(before_knocks(), 0, kFilmed);
  options.placed = [&](int, std::uint64_t i) { return i < knock.at ? before : after; };
  RenderedDrive drive(options);
  for (std::uint64_t i = kFilmed; i < knock.at + static_cast<std::uint64_t>(knock.frames); ++i)
    course.give(drive.frame(i), drive.T_enu_left(i));
  const RigError e = rig_error(course.estimator().calibration(), 1, after);
  std::printf("%s: after %d frames %s\n", knock.name, knock.frames, to_string(e).c_str());
  EXPECT_LT(std::abs(e.t.z()), 0.5e-3 * std::abs(knock.shift_mm.z())) << to_string(e);
  EXPECT_EQ(wrong_ok(course.answers(), {}), "") << course.story();
  for (const Answer& a : course.answers())
    EXPECT_NE(a.sample.status, PoseStatus::lost) << "frame " << a.sample.frame;
}

void expect_noticed_and_mended(const Knock& knock) {
  SCOPED_TRACE(knock.name);
  RenderedDriveOptions options = drive_options();
  const Transform after = knocked(options.rig.T_camera_left[1], knock);
  Course course(with_calibration(options.rig));
  course.give(before_knocks(), 0, kFilmed);
  const Transform before = options.rig.T_camera_left[1];
  options.placed = [&](int, std::uint64_t i) { return i < knock.at ? before : after; };
  RenderedDrive drive(options);
  for (std::uint64_t i = kFilmed; i < knock.at; ++i)
    course.give(drive.frame(i), drive.T_enu_left(i));
  ASSERT_EQ(count_ok(course.answers(), 0, knock.at), static_cast<int>(knock.at)) << course.story();

  const std::uint64_t latest = knock.at + static_cast<std::uint64_t>(knock.frames) + kMend;
  std::uint64_t end = latest, i = knock.at;
  for (; i < end; ++i) {
    course.give(drive.frame(i), drive.T_enu_left(i));
    if (end == latest && course.accepted() != nullptr) end = i + 1 + kAfter;
  }
  const TimedEvent* noticed = course.first(EstimatorEvent::Kind::rig_changed);
  ASSERT_NE(noticed, nullptr) << course.story();
  EXPECT_GE(noticed->frame, knock.at) << course.story();
  EXPECT_LE(noticed->frame, knock.at + static_cast<std::uint64_t>(knock.frames)) << course.story();
  ASSERT_EQ(course.count_accepted(), 1) << course.story();
  const Decided& mended = course.decisions().back();
  EXPECT_LE(mended.frame, noticed->frame + kMend) << course.story();
  for (const Answer& a : course.answers())
    EXPECT_NE(a.sample.status, PoseStatus::lost) << "frame " << a.sample.frame;
  if (knock.matches) {
    EXPECT_EQ(wrong_ok(course.answers(), {}), "") << course.story();
  } else {
    // The path driven without a measured scale remains: right before, and right after.
    const auto after_mending = course.answers().begin() + static_cast<std::ptrdiff_t>(mended.frame);
    EXPECT_EQ(wrong_ok({course.answers().begin(), after_mending}, {}), "") << course.story();
    EXPECT_EQ(wrong_ok({after_mending, course.answers().end()}, {}), "") << course.story();
  }

  // Found from 25 frames or more.
  const RigError e = rig_error(mended.decision.calibration, 1, after);
  std::printf("%s: noticed after %d frames, mended %d later, %s\n", knock.name,
              static_cast<int>(noticed->frame - knock.at),
              static_cast<int>(mended.frame - noticed->frame), to_string(e).c_str());
  EXPECT_LT(e.rotation, 0.25e-3) << to_string(e);
  EXPECT_LT(std::abs(e.t.y()), 2.5e-3) << to_string(e);
  EXPECT_LT(std::abs(e.t.z()), 8e-3) << to_string(e);
  EXPECT_EQ(course.estimator().state(), State::stereo_odometry) << course.story();

  // The odometry with it: between the last two dozen frames as right as before the knock.
  const Answer &last = course.answers().back(),
               &first = course.answers()[course.answers().size() - kAfter / 2];
  const MotionError drift = motion_error(first, last);
  const double way = (last.T_reference_left.t - first.T_reference_left.t).norm();
  EXPECT_LT(drift.translation, 0.02 + 0.005 * way) << course.story();
  EXPECT_LT(drift.rotation, 1e-3);
}

}  // namespace vergence::test
