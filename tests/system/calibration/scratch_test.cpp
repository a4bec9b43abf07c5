// From nothing but the baseline's length, on the paper's rig. One program: the cases share what is
// rendered.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/calibration/gates.hpp"
#include "core/memory/allocation_guard.hpp"
#include "tests/system/calibration/course.hpp"
#include "tests/system/odometry/faults.hpp"

namespace vergence::test {
namespace {

constexpr int kFrames = 60;                     // that a calibration is found from
constexpr double kSpeed = 3.0, kSeconds = 5.0;  // m/s for so long: the drives looked at
// The largest errors allowed from 60 frames.
constexpr double kRotation = 0.15e-3, kAcross = 1.8e-3, kAlong = 4.5e-3;  // rad; m of t_y; m of t_z

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
  static const StereoDrive drive = film(drive_from(starts()[0]), 110);
  return drive;
}

CourseSetting from_sixty(const RigCalibration& rig) {
  CourseSetting s = from_scratch(rig);
  s.options.calibration.min_frames = s.options.calibration.max_frames = kFrames;
  return s;
}

void expect_found(const Course& course, const Transform& truth) {
  const CalibrationDecision* d = course.accepted();
  ASSERT_NE(d, nullptr) << course.story();
  const RigError e = rig_error(d->calibration, 1, truth);
  std::printf("%s\n", to_string(e).c_str());
  EXPECT_LT(e.rotation, kRotation) << to_string(e);
  EXPECT_LT(std::abs(e.t.y()), kAcross) << to_string(e);
  EXPECT_LT(std::abs(e.t.z()), kAlong) << to_string(e);
  EXPECT_NEAR(d->calibration.T_camera_left[1].t.norm(), truth.t.norm(), 1e-12)
      << "the length is known";
  // Six numbers whose sigmas hold up: beyond four in one of them is one case in three thousand.
  EXPECT_LT(e.sigmas, 4.0) << to_string(e);
  EXPECT_EQ(d->calibration.frames, kFrames);
  EXPECT_EQ(course.estimator().state(), State::stereo_odometry);
  EXPECT_TRUE(course.estimator().calibrated());
}

/// Every frame once the first pair is found has a pose, and none without a calibration is called
/// ok.
void expect_poses_all_the_time(const Course& course) {
  bool any = false;
  for (const Answer& a : course.answers()) {
    if (any) {
      EXPECT_NE(a.sample.status, PoseStatus::lost) << course.story();
    }
    any = any || a.sample.status != PoseStatus::lost;
    if (a.sample.state == State::parallel_monocular || a.sample.state == State::calibrating) {
      EXPECT_NE(a.sample.status, PoseStatus::ok) << course.story();
    }
  }
  EXPECT_EQ(wrong_ok(course.answers(), {}), "") << course.story();
  EXPECT_GT(count_ok(course.answers(), 0, 1000), 0) << course.story();
}

TEST(FromScratch, twentyPlacesOfTheDriveGiveTheTransform) {
  const Transform truth = paper_rig().T_camera_left[1];
  Vec3 squares = Vec3::Zero();  // rotation, t_y, t_z
  const std::vector<double> places = starts(20);
  for (const double start : places) {
    SCOPED_TRACE(start);
    const RenderedDriveOptions options = drive_from(start);
    RenderedDrive drive(options);
    Course course(from_sixty(options.rig));
    for (std::uint64_t i = 0; i < 110; ++i) course.give(drive.frame(i), drive.T_enu_left(i));
    expect_found(course, truth);
    expect_poses_all_the_time(course);
    ASSERT_NE(course.accepted(), nullptr);
    const RigError e = rig_error(course.accepted()->calibration, 1, truth);
    squares += Vec3(e.rotation, e.t.y(), e.t.z()).cwiseAbs2();
  }
  const Vec3 rms = (squares / static_cast<double>(places.size())).cwiseSqrt();
  EXPECT_LT(rms.x(), 0.06e-3);
  EXPECT_LT(rms.y(), 0.6e-3);
  EXPECT_LT(rms.z(), 1.8e-3);
}

TEST(FromScratch, allocatesNothingOnAnyThread) {
  if (!AllocationGuard::available())
    GTEST_SKIP() << "this build counts no allocations: the sanitizers bring their own malloc";
  for (const int threads : {1, 2}) {
    CourseSetting s = from_scratch(street().rig);
    s.threads = threads;
    Course course(s);
    course.give(street(), 0, 75);
    EXPECT_FALSE(course.decisions().empty()) << "the solver's share has to be in it\n"
                                             << course.story();
    EXPECT_EQ(course.allocations(), 0U) << threads;
  }
}

bool same_bits(const Transform& a, const Transform& b) { return a.R == b.R && a.t == b.t; }

TEST(FromScratch, isTheSameBitForBitWhateverTheThreads) {
  CourseSetting one = from_scratch(street().rig), several = one;
  one.threads = 1;
  Course a(one), b(several), again(several);
  for (Course* course : {&a, &b, &again}) course->give(street(), 0, 75);
  for (const Course* other : {&b, &again}) {
    ASSERT_EQ(a.answers().size(), other->answers().size());
    for (std::size_t i = 0; i < a.answers().size(); ++i) {
      const PoseSample &p = a.answers()[i].sample, &q = other->answers()[i].sample;
      ASSERT_EQ(p.status, q.status) << i;
      ASSERT_EQ(p.state, q.state) << i;
      ASSERT_EQ(p.reason, q.reason) << i;
      ASSERT_EQ(p.inliers, q.inliers) << i;
      ASSERT_TRUE(same_bits(p.T_world_left, q.T_world_left)) << i;
    }
    ASSERT_EQ(a.decisions().size(), other->decisions().size());
    for (std::size_t i = 0; i < a.decisions().size(); ++i) {
      const CalibrationDecision &c = a.decisions()[i].decision, &d = other->decisions()[i].decision;
      EXPECT_EQ(a.decisions()[i].frame, other->decisions()[i].frame);
      EXPECT_EQ(c.accepted, d.accepted);
      EXPECT_TRUE(same_bits(c.calibration.T_camera_left[1], d.calibration.T_camera_left[1]));
      EXPECT_EQ(c.calibration.sigma_noise[1], d.calibration.sigma_noise[1]);
      EXPECT_EQ(c.calibration.sigma_wide[1], d.calibration.sigma_wide[1]);
    }
  }
  EXPECT_FALSE(a.decisions().empty()) << a.story();
}

TEST(FromScratch, aDriveThatEndsEarlyIsDecidedAtItsEnd) {
  Course course(from_scratch(street().rig));
  course.give(street(), 0, 28);
  EXPECT_TRUE(course.decisions().empty()) << course.story();
  course.finish();
  ASSERT_EQ(course.count_accepted(), 1) << course.story();
  const RigError e = rig_error(course.accepted()->calibration, 1, street().rig.T_camera_left[1]);
  // From 25 frames.
  EXPECT_LT(e.rotation, 0.25e-3) << to_string(e);
  EXPECT_LT(std::abs(e.t.y()), 2.5e-3) << to_string(e);
  EXPECT_LT(std::abs(e.t.z()), 8e-3) << to_string(e);
}

TEST(FromScratch, exchangedCamerasAreNeverAdoptedAndItSaysWhy) {
  Course course(from_scratch(street().rig));
  course.give(street(), 0, street().size(), swap_cameras(0, street().size()));
  course.finish();
  EXPECT_EQ(course.count_accepted(), 0) << course.story();
  EXPECT_TRUE(course.rejected_for(calibration::reason(calibration::Gate::cameras_swapped)))
      << course.story();
  EXPECT_EQ(count_ok(course.answers(), 0, street().size()), 0) << course.story();
  EXPECT_TRUE(std::any_of(course.answers().begin(), course.answers().end(), [](const Answer& a) {
    return a.sample.reason == Reason::cameras_swapped;
  })) << course.story();
  EXPECT_FALSE(course.estimator().calibrated());
}

/// The right camera's image is the one of the frame before.
bool one_late(std::size_t i, RigFrame* frame) {
  if (i == 0) return false;
  frame->images[1] = street().pairs[i - 1][1].view();
  return true;
}

TEST(FromScratch, aCameraAFrameLateFromTheStartIsRefused) {
  Course course(from_scratch(street().rig));
  course.give(street(), 0, street().size(), one_late);
  course.finish();
  EXPECT_EQ(course.count_accepted(), 0) << course.story();
  EXPECT_TRUE(course.rejected_for(calibration::reason(calibration::Gate::out_of_step)) ||
              course.rejected_for(calibration::reason(calibration::Gate::implausible_direction)))
      << course.story();
  EXPECT_EQ(wrong_ok(course.answers(), {}), "") << course.story();
  EXPECT_EQ(count_ok(course.answers(), 0, street().size()), 0) << course.story();
}

TEST(WithACalibration, aCameraAFrameLateFromTheStartIsTold) {
  Course course(with_calibration(street().rig));
  course.give(street(), 0, street().size(), one_late);
  course.finish();
  EXPECT_EQ(wrong_ok(course.answers(), {}), "") << course.story();
  EXPECT_NE(course.first(EstimatorEvent::Kind::rig_changed), nullptr) << course.story();
  EXPECT_EQ(course.count_accepted(), 0) << course.story();
}

/// A place where the rig stands: a few pictures with noise of their own, again and again.
struct Standing {
  static constexpr std::size_t kPictures = 6;
  StereoDrive still;
  explicit Standing(const RenderedDriveOptions& options) : still(film(options, kPictures)) {}
  void give(Course* course, std::uint64_t first, std::uint64_t last) const {
    for (std::uint64_t i = first; i < last; ++i) {
      RigFrame frame;
      frame.number = i;
      frame.stamp = still.stamps[0] + Duration::seconds(static_cast<double>(i) / 30.0);
      frame.cameras = 2;
      for (std::size_t k = 0; k < 2; ++k) frame.images[k] = still.pairs[i % kPictures][k].view();
      course->give(frame, still.truth[0]);
    }
  }
};

RenderedDriveOptions standing_drive() {
  RenderedDriveOptions o;
  o.drive.kind = mock::DriveKind::still;
  o.from_s = 3;
  return o;
}

TEST(StandingStill, fromScratchSaysThatItNeedsMotionAndAdoptsNothing) {
  const Standing place(standing_drive());
  Course course(from_scratch(place.still.rig));
  place.give(&course, 0, 60);
  EXPECT_EQ(course.count_accepted(), 0) << course.story();
  EXPECT_FALSE(course.estimator().calibrated());
  for (const Answer& a : course.answers()) {
    EXPECT_NE(a.sample.status, PoseStatus::ok) << course.story();
    if (a.sample.frame >= 30) {
      EXPECT_EQ(a.sample.reason, Reason::needs_motion) << "frame " << a.sample.frame << '\n'
                                                       << course.story();
    }
  }
  EXPECT_NE(course.first(EstimatorEvent::Kind::calibration_waits), nullptr) << course.story();
  course.finish();
  EXPECT_EQ(course.count_accepted(), 0) << course.story();
}

TEST(StandingStill, aMinuteIsNoKnock) {
  const Standing place(standing_drive());
  Course course(with_calibration(place.still.rig));
  place.give(&course, 0, 1800);
  EXPECT_EQ(course.first(EstimatorEvent::Kind::rig_changed), nullptr) << course.story();
  EXPECT_EQ(count_ok(course.answers(), 0, 1800), 1800) << course.story();
  EXPECT_EQ(wrong_ok(course.answers(), {}), "");
}

TEST(StandingStill, aKnockIsNoticedAndWaitsForMotion) {
  const Standing before(standing_drive());
  RenderedDriveOptions knocked = standing_drive();
  knocked.rig.T_camera_left[1] = perturbed(knocked.rig.T_camera_left[1],
                                           Vec3(0.5 * std::numbers::pi / 180, 0, 0), Vec3::Zero());
  const Standing after(knocked);
  Course course(with_calibration(before.still.rig));
  constexpr std::uint64_t kKnock = 40, kEnd = 100;
  before.give(&course, 0, kKnock);
  EXPECT_EQ(count_ok(course.answers(), 0, kKnock), static_cast<int>(kKnock)) << course.story();
  after.give(&course, kKnock, kEnd);
  // A rig that stood from the start has not confirmed its calibration: it may never have been the
  // right one.
  const Told* noticed = course.first(EstimatorEvent::Kind::calibration_contradicted);
  ASSERT_NE(noticed, nullptr) << course.story();
  EXPECT_GE(noticed->frame, kKnock);
  EXPECT_LE(noticed->frame, kKnock + 15) << course.story();
  EXPECT_EQ(course.count_accepted(), 0) << course.story();
  EXPECT_EQ(course.estimator().state(), State::recalibrating) << course.story();
  const PoseSample& last = course.answers().back().sample;
  EXPECT_EQ(last.status, PoseStatus::degraded);
  EXPECT_EQ(last.reason, Reason::needs_motion) << course.story();
  EXPECT_EQ(wrong_ok(course.answers(), {}), "") << course.story();
}

TEST(ThreeCameras, allTransformsAreFound) {
  RigCalibration rig;
  rig.cameras = 3;
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
  CourseSetting setting = from_sixty(rig);
  setting.nominal.T_camera_left[2] = {
      Mat3::Identity(), {-0.25, -0.05, 0}};  // where it is mounted, as one would measure it
  Course course(setting);
  // Pixels twice as wide as the paper's: the sigmas that are enough are as much larger.
  for (std::uint64_t i = 0; i < 110 && course.accepted() == nullptr; ++i)
    course.give(drive.frame(i), drive.T_enu_left(i));
  ASSERT_NE(course.accepted(), nullptr) << course.story();
  const RigCalibration& found = course.accepted()->calibration;
  for (int k = 1; k < 3; ++k) {
    const RigError e = rig_error(found, k, rig.T_camera_left[static_cast<std::size_t>(k)]);
    std::printf("camera %d: %s\n", k, to_string(e).c_str());
    EXPECT_LT(e.sigmas, 4.0) << k << ' ' << to_string(e);
    EXPECT_LT(e.rotation, 1247.0 / 550.0 * kRotation) << k << ' ' << to_string(e);
    EXPECT_LT(std::abs(e.t.y()), 1247.0 / 550.0 * kAcross) << k << ' ' << to_string(e);
    EXPECT_LT(std::abs(e.t.z()), 1247.0 / 550.0 * kAlong) << k << ' ' << to_string(e);
  }
  EXPECT_NEAR(found.T_camera_left[1].t.norm(), rig.baseline, 1e-12);
}

}  // namespace
}  // namespace vergence::test
