// Recorded excerpts, calibrated from nothing but the baseline's length.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "core/comparison/trajectory_metrics.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/system/odometry/estimator_run.hpp"
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
  EstimatorRunOptions setting = from_scratch(drive.rig);
  setting.options.calibration.min_frames = frames;
  EstimatorRun run(setting);
  run.process(drive);
  if (run.accepted() == nullptr) run.finish();
  EXPECT_NE(run.accepted(), nullptr) << run.describe();
  for (const FrameResult& a : run.results())
    EXPECT_NE(a.sample.status, PoseStatus::lost) << a.sample.frame;
  if (run.accepted() == nullptr) return std::nullopt;
  return run.accepted()->calibration;
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

/// ATE in m of the sequence with this calibration.
double ate_with(const StereoDrive& drive, const RigCalibration& rig) {
  EstimatorRun run(with_supplied(rig));
  run.process(drive);
  return evaluate_results(run.results(), {10}).ate_se3.rmse;
}

TEST(RecordedFromScratch, eurocTransformIsFoundFromBaselineLength) {
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
  const double found_m = ate_with(*drive, *found), published_m = ate_with(*drive, drive->rig);
  std::printf("euroc: ATE %.2f mm with it, %.2f mm with the published one\n", 1e3 * found_m,
              1e3 * published_m);
  EXPECT_LT(found_m, published_m + 1e-3);
}

}  // namespace
}  // namespace vergence::test
