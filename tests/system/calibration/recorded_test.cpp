// Recorded excerpts, calibrated from nothing but the baseline's length.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "core/comparison/trajectory_metrics.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/system/calibration/test_trajectory.hpp"
#include "tests/system/odometry/recorded_drive.hpp"

namespace vergence::test {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr int kFrames = 45;  // nearly all there are of the shorter excerpt

/// The whole of it.
std::optional<StereoDrive> excerpt(Excerpt which) {
  const auto folder = shared_data(which.folder);
  if (!folder) return std::nullopt;
  which.frames = std::numeric_limits<std::size_t>::max();
  return load(which, *folder);
}

/// The calibration found from so many frames or more, decided at the end of the drive at the
/// latest. Intrinsics held.
std::optional<RigCalibration> calibrate(const StereoDrive& drive, int frames) {
  CourseSetting setting = from_scratch(drive.rig);
  setting.options.calibration.min_frames = frames;
  Course course(setting);
  course.give(drive, 0, drive.size());
  if (course.accepted() == nullptr) course.finish();
  EXPECT_NE(course.accepted(), nullptr) << course.story();
  for (const Answer& a : course.answers())
    EXPECT_NE(a.sample.status, PoseStatus::lost) << a.sample.frame;
  if (course.accepted() == nullptr) return std::nullopt;
  return course.accepted()->calibration;
}

/// Rotation vector in degrees from one calibration to another.
Vec3 turned(const RigCalibration& to, const Mat3& from) {
  return log_so3(to.T_camera_left[1].R * from.transpose()) / kDegree;
}

void print(const char* name, const RigCalibration& rig) {
  const Vec3 r = log_so3(rig.T_camera_left[1].R) / kDegree, t = rig.T_camera_left[1].t;
  std::printf("%s: rotation vector %.4f %.4f %.4f deg, t %.5f %.5f %.5f m, from %d frames\n", name,
              r.x(), r.y(), r.z(), t.x(), t.y(), t.z(), rig.frames);
}

/// Result of a second drive with the estimated calibration.
TrajectoryEvaluation odometry_with(StereoDrive drive, const RigCalibration& rig) {
  drive.rig = rig;
  std::vector<StampedPose> estimate, truth;
  for (const Answer& a : replay(drive, {}, 2).answers) {
    if (a.sample.status == PoseStatus::lost) continue;
    estimate.push_back({a.sample.stamp, a.sample.T_world_left});
    truth.push_back({a.sample.stamp, a.T_reference_left});
  }
  EvaluationOptions options;
  options.segments = {{{10, 20, 30, 40, 50}, 1, false}, {{10, 20, 30, 40, 50}, 1, true}};
  return evaluate(estimate, truth, options);
}

TEST(RecordedFromScratch, eurocsPublishedTransformIsFound) {
  const auto drive = excerpt(kEuroc);
  if (!drive) GTEST_SKIP() << shared_data_missing(kEuroc.folder);
  const auto found = calibrate(*drive, kFrames);
  ASSERT_TRUE(found);
  print("euroc", *found);
  const Transform& published = drive->rig.T_camera_left[1];
  EXPECT_LT(turned(*found, published.R).norm(), 0.08);
  const Vec3 &a = found->T_camera_left[1].t, &b = published.t;
  EXPECT_LT(std::atan2(a.cross(b).norm(), a.dot(b)) / kDegree, 0.5);
  EXPECT_NEAR(a.norm(), 0.11007784, 1e-6);
  const TrajectoryEvaluation with_found = odometry_with(*drive, *found),
                             with_published = odometry_with(*drive, drive->rig);
  std::printf("euroc: ATE %.2f mm with it, %.2f mm with the published one\n",
              1e3 * with_found.ate_se3.rmse, 1e3 * with_published.ate_se3.rmse);
  EXPECT_LT(with_found.ate_se3.rmse, with_published.ate_se3.rmse + 1e-3);
}

}  // namespace
}  // namespace vergence::test
