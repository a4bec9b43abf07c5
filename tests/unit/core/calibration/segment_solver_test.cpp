// A drive cut into stretches, each solved with the lenses free.
#include "core/calibration/segment_solver.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "core/calibration/health.hpp"
#include "tests/unit/core/calibration/feature_log.hpp"

namespace vergence::test {
namespace {

using namespace calibration;

constexpr std::size_t kStretch = 30, kFeatures = 300, kLogged = 40;
// Sigmas of zero select the priors of the options.
constexpr std::array<double, 4> kNotGiven = {0, 0, 0, 0};

/// A drive whose estimator's log is shown to the stretches after every few frames, as an
/// application does.
struct Driven {
  FeatureDrive drive;
  CalibrationOptions options;
  calibration::MonitorOptions monitor;
  Arena log_arena, arena;
  TrackLog log{kLogged, kFeatures, log_arena};
  SegmentSolver stretches;
  std::vector<RigSolution> solved;

  static CalibrationOptions small(double extrinsic_random_walk_mrad_per_sqrt_h) {
    CalibrationOptions o{
        .max_frames = static_cast<int>(kStretch),
        .extrinsic_random_walk_mrad_per_sqrt_h = extrinsic_random_walk_mrad_per_sqrt_h};
    return o;
  }
  Driven(const FeatureDriveOptions& o, SegmentSolver::Kind kind, const RigCalibration& given,
         const RigCalibration& start, double extrinsic_random_walk_mrad_per_sqrt_h = 0.3)
      : drive(o),
        options(small(extrinsic_random_walk_mrad_per_sqrt_h)),
        stretches(kind, given, start, kStretch, options, monitor, kFeatures, arena) {}
  void go(int frames) {
    for (int i = 0; i < frames; i += 10) {
      log_drive(drive, 10, {}, log);
      if (const auto s = stretches.add(log)) solved.push_back(*s);
    }
  }
};

/// Where a solve begins: some mrad and centimetres off.
RigCalibration rough(const RigCalibration& rig) {
  RigCalibration r = rig;
  r.T_camera_left[1] = perturbed(r.T_camera_left[1], {3e-3, -3e-3, 3e-3}, {0, 0.01, -0.01});
  r.T_camera_left[1].t *= rig.baseline / r.T_camera_left[1].t.norm();
  return r;
}

FeatureDriveOptions little_noise() {
  FeatureDriveOptions o = exact_drive();
  o.white_px = 0.1;
  o.sigma_px = 0.1;
  return o;
}

/// A drive and its rig, of whose lenses no sigma is given.
struct Segments : testing::Test {
  const FeatureDriveOptions o = little_noise();
  const RigCalibration given = rig_of(o, {o.left, o.right}, kNotGiven);
};

TEST_F(Segments, independentSegmentsFindTheTransform) {
  Driven d(o, SegmentSolver::Kind::alone, given, rough(given));
  d.go(90);
  ASSERT_EQ(d.solved.size(), 3U);
  for (const RigSolution& s : d.solved) {
    ASSERT_EQ(s.status, RigSolveStatus::ok);
    EXPECT_EQ(s.frames, static_cast<int>(kStretch));
    const Vec5 e = five_errors(s.rig, o.T_right_left);
    const Mat5 C = five_covariance(s.rig.covariance_total[1]);
    // None of fifteen errors is beyond four sigmas. A yaw is correlated with a principal point, so
    // their joint effect on the depth counts: it is within the tolerance, and began at 20 m · 3
    // mrad / 0.75 m, 8 %.
    for (int i = 0; i < 5; ++i) EXPECT_LT(std::abs(e[i]), 4 * std::sqrt(C(i, i))) << i;
    EXPECT_LT(calibration::depth_error_percent(rig_of(o), s.rig, 1, 20), 2.0) << e.transpose();
    EXPECT_EQ(s.rig.frames, static_cast<int>(kStretch)) << "of its own frames only";
  }
  EXPECT_EQ(d.stretches.frames(), 90U);
  EXPECT_NE(d.solved[0].rig.T_camera_left[1].t, d.solved[1].rig.T_camera_left[1].t)
      << "disjoint tracks";
}

TEST_F(Segments, joinedSegmentsReduceTheSigmas) {
  Driven joined(o, SegmentSolver::Kind::joined, given, rough(given)),
      alone(o, SegmentSolver::Kind::alone, given, rough(given));
  joined.go(90);
  alone.go(90);
  ASSERT_EQ(joined.solved.size(), 3U);
  ASSERT_EQ(alone.solved.size(), 3U);
  for (const RigSolution& s : joined.solved) ASSERT_EQ(s.status, RigSolveStatus::ok);
  const auto sigma = [](const RigSolution& s, int row) {
    return std::sqrt(s.rig.covariance(row, row));
  };
  for (const int i : {0, 1, 2, 4, 5}) {
    const int row = extrinsic_row(1) + i;
    EXPECT_LT(sigma(joined.solved[2], row), sigma(joined.solved[0], row)) << i;
  }
  const Vec5 e = five_errors(joined.solved[2].rig, o.T_right_left);
  for (int i = 0; i < 5; ++i)
    EXPECT_LT(std::abs(e[i]),
              4 * std::sqrt(five_covariance(joined.solved[2].rig.covariance_total[1])(i, i)))
        << i;
  EXPECT_EQ(joined.solved[2].rig.frames, 3 * static_cast<int>(kStretch));
  // The first segment has no predecessor of either kind.
  EXPECT_EQ(joined.solved[0].rig.T_camera_left[1].t, alone.solved[0].rig.T_camera_left[1].t);
  EXPECT_NE(joined.solved[1].rig.T_camera_left[1].t, alone.solved[1].rig.T_camera_left[1].t);
}

TEST_F(Segments, wrongPrincipalPointIsEstimated) {
  Pinhole wrong = o.right;
  wrong.cx -= 5;
  const RigCalibration off = rig_of(o, {o.left, wrong}, kNotGiven);
  Driven d(o, SegmentSolver::Kind::joined, off, off);
  d.go(90);
  ASSERT_EQ(d.solved.size(), 3U);
  const RigSolution& s = d.solved.back();
  ASSERT_EQ(s.status, RigSolveStatus::ok);
  const Intrinsics& lens = s.rig.intrinsics[1];
  EXPECT_GT(lens.sigma[2], 0);
  // Held camera 0 may be off by what it may: the joint covariance has that in it.
  const double sigma = std::sqrt(s.rig.covariance(intrinsic_row(1) + 2, intrinsic_row(1) + 2));
  EXPECT_LT(std::abs(lens.cx - o.right.cx), 4 * sigma) << sigma;
  EXPECT_LT(std::abs(lens.cx - o.right.cx), 2.5) << "and most of the five pixels are found";
}

TEST_F(Segments, repeatedFramesAreTakenOnce) {
  Driven d(o, SegmentSolver::Kind::alone, given, given);
  log_drive(d.drive, 20, {}, d.log);
  for (int i = 0; i < 5; ++i) EXPECT_FALSE(d.stretches.add(d.log).has_value());
  EXPECT_EQ(d.stretches.frames(), 20U);
  log_drive(d.drive, 10, {}, d.log);
  EXPECT_TRUE(d.stretches.add(d.log).has_value());
  EXPECT_FALSE(d.stretches.add(d.log).has_value());
  EXPECT_EQ(d.stretches.frames(), 30U);
}

TEST_F(Segments, lastSegmentIsSolvedFromTheMinimumOn) {
  // CalibrationOptions::min_frames is 25.
  for (const int frames : {24, 25}) {
    Driven d(o, SegmentSolver::Kind::joined, given, given);
    log_drive(d.drive, frames, {}, d.log);
    EXPECT_FALSE(d.stretches.add(d.log).has_value());
    const auto s = d.stretches.end();
    ASSERT_EQ(s.has_value(), frames == 25) << frames;
    if (s.has_value()) {
      EXPECT_EQ(s->status, RigSolveStatus::ok);
      EXPECT_EQ(s->frames, frames);
    }
    EXPECT_FALSE(d.stretches.end().has_value()) << "once";
  }
}

// An angle of the walk of an hour, 0.3 mrad, is many times what 30 frames leave open: after a day
// what was known hardly counts.
TEST_F(Segments, oldPriorHasLessWeight) {
  double sigma[2];
  for (const bool later : {false, true}) {
    Driven d(o, SegmentSolver::Kind::joined, given, given);
    d.go(30);
    log_drive(d.drive, 30, {}, d.log);
    for (std::size_t i = 0; later && i < d.log.size(); ++i)
      d.log.frame(i).stamp = Stamp(d.log.frame(i).stamp.ns() + 24LL * 3600 * 1'000'000'000);
    const auto s = d.stretches.add(d.log);
    ASSERT_TRUE(s.has_value() && s->status == RigSolveStatus::ok);
    sigma[later ? 1 : 0] = std::sqrt(s->rig.covariance(extrinsic_row(1) + 1, extrinsic_row(1) + 1));
  }
  EXPECT_GT(sigma[1], sigma[0]);
}

// The prior is widened once for the time that has passed, whether or not a solve failed meanwhile.
TEST_F(Segments, failedSegmentLeavesTheNextUnchanged) {
  RigSolution third[2];
  for (const bool tried : {false, true}) {
    Driven d(o, SegmentSolver::Kind::joined, given, given, 10);
    d.go(30);
    for (std::size_t i = 0; i < kStretch; ++i) {
      d.drive.next();
      LoggedFrame f;
      f.number = d.drive.frame();
      f.stamp = d.drive.stamp();
      if (tried) d.log.begin(f);
    }
    if (tried) {
      const auto s = d.stretches.add(d.log);
      ASSERT_TRUE(s.has_value());
      EXPECT_NE(s->status, RigSolveStatus::ok) << "nothing was seen";
    }
    log_drive(d.drive, 30, {}, d.log);
    const auto s = d.stretches.add(d.log);
    ASSERT_TRUE(s.has_value() && s->status == RigSolveStatus::ok);
    third[tried ? 1 : 0] = *s;
  }
  EXPECT_EQ(third[0].rig.T_camera_left[1].t, third[1].rig.T_camera_left[1].t);
  EXPECT_EQ(third[0].rig.sigma_noise[1], third[1].rig.sigma_noise[1]);
}

}  // namespace
}  // namespace vergence::test
