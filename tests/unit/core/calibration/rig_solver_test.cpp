#include "core/calibration/rig_solver.hpp"

#include <gtest/gtest.h>

#include "core/calibration/posterior.hpp"
#include "tests/unit/core/calibration/feature_log.hpp"

namespace vergence::test {
namespace {

using namespace calibration;

// Independently posed cameras have smaller errors than these.
constexpr LogStart kRough{2e-3, 0.02, 5e-3, 0.02};

CalibrationOptions held() {
  return {.max_frames = 60, .intrinsics = calibration::IntrinsicsEstimation::fixed};
}

/// A solver whose log holds the first frames of a drive from the same rough start.
struct Logged : SolverInArena {
  explicit Logged(const FeatureDriveOptions& street, int frames = 40,
                  const CalibrationOptions& o = held(), const FurtherCamera* further = nullptr)
      : SolverInArena(o, further != nullptr ? 3 : 2) {
    FeatureDrive drive(street);
    log_drive(drive, frames, kRough, solver.log(), further);
  }
  /// Changes every frame of the log from `first` on.
  template <class Change>
  Logged& each_frame(const Change& change, std::size_t first = 0) {
    for (std::size_t i = first; i < solver.log().size(); ++i) change(solver.log().frame(i));
    return *this;
  }
};

RigSolution solve(const FeatureDriveOptions& drive_options, const CalibrationOptions& o,
                  const RigCalibration& rig) {
  return Logged(drive_options, 40, o).solver.solve({.rig = rig});
}

TEST(RigSolver, exactTracksGiveTheExactTransform) {
  const FeatureDriveOptions drive = exact_drive();
  const RigSolution s = solve(drive, held(), rig_of(drive));
  ASSERT_EQ(s.status, RigSolveStatus::ok);
  // Pixels are logged as floats: up to 3e-5 px of rounding near 1000 px. One pair of images turns
  // that into 3e-8 rad; over tens of thousands of observations rotation is better than that. t_y
  // and t_z follow from directions to points 10 to 20 m away: 1e-6 m at most.
  const Vec5 e = five_errors(s.rig, drive.T_right_left);
  EXPECT_LT(e.head<3>().cwiseAbs().maxCoeff(), 3e-8) << e.transpose();
  EXPECT_LT(e.tail<2>().cwiseAbs().maxCoeff(), 1e-6) << e.transpose();
  EXPECT_NEAR(s.rig.T_camera_left[1].t.norm(), drive.T_right_left.t.norm(), 1e-12);
  EXPECT_LT(s.rig.reprojection_px, 3e-5);
  EXPECT_EQ(s.frames, 40);
  EXPECT_EQ(s.rig.frames, 40);
  EXPECT_EQ(s.newest, 39U);
  EXPECT_EQ(s.lag_frames, 0);
  EXPECT_GT(s.near, 0);
  EXPECT_LE(s.near, s.tracks);
  // 39 steps of 8 m/s at 30 Hz.
  EXPECT_NEAR(s.travelled_m, 39 * 8.0 / 30.0, 0.1);
}

TEST(RigSolver, uncertainIntrinsicsWidenTheSigmas) {
  const FeatureDriveOptions drive;
  const RigSolution exact = solve(drive, held(), rig_of(drive));
  const RigSolution uncertain =
      solve(drive, held(), rig_of(drive, {drive.left, drive.right}, {1.2, 1.2, 0.5, 0.5}));
  ASSERT_EQ(exact.status, RigSolveStatus::ok);
  ASSERT_EQ(uncertain.status, RigSolveStatus::ok);
  EXPECT_EQ(exact.rig.T_camera_left[1].t, uncertain.rig.T_camera_left[1].t)
      << "held intrinsics are held";
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_NEAR(uncertain.rig.sigma_noise[1][i], exact.rig.sigma_noise[1][i],
                1e-12 + 1e-9 * exact.rig.sigma_noise[1][i]);
    EXPECT_GE(uncertain.rig.sigma_total[1][i], uncertain.rig.sigma_noise[1][i]);
  }
  // Half a pixel of the principal point is 0.4 mrad of pitch, many times what tracks leave open.
  EXPECT_GT(uncertain.rig.sigma_total[1][0], 3e-4);
}

TEST(RigSolver, freeFocalLengthIsEstimated) {
  FeatureDriveOptions drive = exact_drive();
  drive.right.fx *= 1.002;
  drive.right.fy *= 1.002;
  CalibrationOptions o = held();
  o.intrinsics = calibration::IntrinsicsEstimation::focal;
  // Two thousandths off, known to five: the tracks outweigh that by far.
  const double sigma = 0.005 * drive.left.fx;
  const RigSolution s =
      solve(drive, o, rig_of(drive, {drive.left, drive.left}, {sigma, sigma, 1e-6, 1e-6}));
  ASSERT_EQ(s.status, RigSolveStatus::ok);
  EXPECT_NEAR(s.rig.intrinsics[1].fx, drive.right.fx,
              0.05 * std::abs(drive.right.fx - drive.left.fx));
  EXPECT_NEAR(s.rig.intrinsics[1].fy, drive.right.fy,
              0.05 * std::abs(drive.right.fy - drive.left.fy));
  EXPECT_EQ(s.rig.intrinsics[0].fx, drive.left.fx);
  EXPECT_LT(s.rig.intrinsics[1].sigma[0], sigma);
}

/// Held, and lenses off by nothing: the scale's sigma is what tracks make it.
CalibrationOptions held_by_tracks() {
  CalibrationOptions o = held();
  o.focal_sigma_percent = o.principal_point_sigma_px = 0;
  return o;
}

// White noise five times as large makes the length driven five times as uncertain; each sigma rests
// on a residual variance and on the variance of some hundred clusters, 10 % of it.
TEST(RigSolver, scaleSigmaGrowsWithTheNoise) {
  FeatureDriveOptions drive = exact_drive();
  drive.white_px = 0.1;
  const RigSolution quiet = solve(drive, held_by_tracks(), rig_of(drive));
  drive.white_px = 0.5;
  const RigSolution noisy = solve(drive, held_by_tracks(), rig_of(drive));
  ASSERT_EQ(quiet.status, RigSolveStatus::ok);
  ASSERT_EQ(noisy.status, RigSolveStatus::ok);
  EXPECT_GT(quiet.rig.scale_sigma, 0);
  EXPECT_NEAR(noisy.rig.scale_sigma / quiet.rig.scale_sigma, 5.0, 1.0);
}

TEST(RigSolver, scaleSigmaIsIndependentOfTheWorldOrigin) {
  const FeatureDriveOptions drive;
  double sigma[2];
  for (const std::size_t i : {0U, 1U}) {
    Logged s(drive, 40, held_by_tracks());
    const Transform moved{exp_so3({0.1, 0.7, -0.2}), {30, -5, -20}};
    if (i == 1) s.each_frame([&](auto& f) { f.T_left_world = f.T_left_world * moved; });
    const RigSolution solution = s.solver.solve({.rig = rig_of(drive)});
    ASSERT_EQ(solution.status, RigSolveStatus::ok);
    sigma[i] = solution.rig.scale_sigma;
  }
  // Each ends within a step that changes the cost by less than 3e-6 of it: some thousandths of a
  // sigma.
  EXPECT_NEAR(sigma[1] / sigma[0], 1.0, 0.01);
}

// Half as long a way whose errors are independent is √2 times as uncertain, one that hangs on the
// yaw no more than the whole.
TEST(RigSolver, scaleSigmaIsOfTheNewestConnectedFrames) {
  const FeatureDriveOptions drive;
  double sigma[2];
  for (const std::size_t pieces : {1U, 2U}) {
    Logged s(drive, 40, held_by_tracks());
    const auto renumber = [](auto& frame) {
      for (auto& seen : frame.observations) seen.track += 1'000'000;
    };
    if (pieces == 2) s.each_frame(renumber, 20);
    const RigSolution solution = s.solver.solve({.rig = rig_of(drive)});
    ASSERT_EQ(solution.status, RigSolveStatus::ok);
    sigma[pieces - 1] = solution.rig.scale_sigma;
  }
  EXPECT_GT(sigma[1], sigma[0]);
  EXPECT_LT(sigma[1], 2 * sigma[0]);
}

TEST(RigSolver, solveIsIndependentOfThePreviousOne) {
  const FeatureDriveOptions first, other = [] {
    FeatureDriveOptions o;
    o.seed = 7;
    o.T_right_left = {exp_so3({-0.01, 0.004, 0.002}), {-0.6, 0.03, 0.01}};
    return o;
  }();
  Logged used(first, 50), fresh(other, 30);
  (void)used.solver.solve({.rig = rig_of(first)});
  used.solver.log().clear();
  FeatureDrive again(other);
  log_drive(again, 30, kRough, used.solver.log());
  const RigSolution s = used.solver.solve({.rig = rig_of(other)}),
                    t = fresh.solver.solve({.rig = rig_of(other)});
  ASSERT_EQ(s.status, RigSolveStatus::ok);
  EXPECT_EQ(s.rig.T_camera_left[1].R, t.rig.T_camera_left[1].R);
  EXPECT_EQ(s.rig.T_camera_left[1].t, t.rig.T_camera_left[1].t);
  EXPECT_EQ(s.rig.sigma_total[1], t.rig.sigma_total[1]);
}

// Five frames of a rig that hardly moves, lenses free: pitch and centre, yaw and centre go
// together.
TEST(RigSolver, transformWithoutSigmasIsAPriorOfASolveFromLittleMotion) {
  for (const std::uint64_t seed : {1U, 2U}) {
    const FeatureDriveOptions drive{.speed = 0.05, .seed = seed};
    Logged s(drive, 5, {.max_frames = 60});
    const RigCalibration rig = rig_of(drive, {drive.left, drive.right}, {0, 0, 0, 0});
    RigCalibration prior = rig;
    prior.inflation = kUsualInflation;
    assume_transforms(kSuppliedTransform, &prior);
    const auto displaced = [&](const RigCalibration* known) {
      const RigSolution found = s.solver.solve({.rig = rig, .from_rig = true, .known = known});
      EXPECT_EQ(found.status, RigSolveStatus::ok);
      return five_errors(found.rig, drive.T_right_left).norm();
    };
    EXPECT_LT(displaced(&prior), 0.6 * displaced(nullptr)) << seed;
  }
}

TEST(RigSolver, lagOfTheSecondOrThirdCameraIsFound) {
  // Standing starts and stops: at one speed a lag is a transform like any other.
  FeatureDriveOptions drive;
  drive.speed = drive.drive_s = 4;
  drive.stop_s = 0.2;
  const FurtherCamera second{1, {exp_so3({-6e-3, 4e-3, 2e-3}), {-0.4, -0.05, 0.01}}};
  CalibrationOptions o = held();
  o.max_frames = 110;
  for (const bool three : {false, true})
    for (const int lag : {0, 1}) {
      drive.lags = {{0, 1.0 * lag}};
      Logged s(drive, 110, o, three ? &second : nullptr);
      const RigSolution solution =
          s.solver.solve({.rig = three ? rig_of(drive, second) : rig_of(drive)});
      ASSERT_EQ(solution.status, RigSolveStatus::ok) << three << ' ' << lag;
      EXPECT_EQ(solution.lag_frames, lag) << three;
    }
}

TEST(RigSolver, exposureOffsetIsDistinguishedFromALooseCamera) {
  FeatureDriveOptions offset;
  for (const double frames : {0.3, -0.2}) {
    offset.lags = {{0, frames}};
    const RigSolution s = solve(offset, held(), rig_of(offset));
    ASSERT_EQ(s.status, RigSolveStatus::ok) << frames;
    EXPECT_NEAR(s.offset_frames, frames, 0.1);
  }
  FeatureDriveOptions loose;
  for (std::uint64_t at = 5; at < 40; at += 5)
    loose.changes.push_back({.frame = at, .rotation = Vec3(at % 2 == 0 ? 3e-3 : -3e-3, 0, 0)});
  const RigSolution s = solve(loose, held(), rig_of(loose));
  EXPECT_GT(s.changed_at, 0U);
  EXPECT_EQ(s.offset_frames, 0);
}

// Where camera 2 has no pose yet it lies where the left one is: such a frame is none to begin with,
// however well it fits.
TEST(RigSolver, frameWithoutEveryPoseIsNoCandidate) {
  const FeatureDriveOptions drive = exact_drive();
  const FurtherCamera second{2, {exp_so3({-6e-3, 4e-3, 2e-3}), {-0.4, -0.05, 0.01}}};
  Logged s(drive, 60, held(), &second);
  auto& unplaced = s.solver.log().frame(30);
  unplaced.T_camera_left[2] = Transform{};
  unplaced.reprojection_px = 0.1;
  EXPECT_EQ(s.solver.solve({.rig = rig_of(drive, second)}).status, RigSolveStatus::ok);
  s.each_frame([](auto& f) { f.T_camera_left[2] = Transform{}; });
  EXPECT_EQ(s.solver.solve({.rig = rig_of(drive, second)}).status, RigSolveStatus::no_candidate);
}

TEST(RigSolver, insufficientTracksGiveTheirStatus) {
  const FeatureDriveOptions drive = exact_drive();
  const RigCalibration rig = rig_of(drive);
  SolverInArena empty(held());
  EXPECT_EQ(empty.solver.solve({.rig = rig}).status, RigSolveStatus::no_candidate);

  Logged linked(drive, 30);
  linked.each_frame([](auto& f) { f.unlinked = false; });
  EXPECT_EQ(linked.solver.solve({.rig = rig}).status, RigSolveStatus::no_candidate)
      << "no frame measured the cameras each for itself";

  Logged one_eyed(drive, 30);
  one_eyed.each_frame([](auto& f) {
    for (auto& s : f.observations) s.cameras = 1;
  });
  EXPECT_EQ(one_eyed.solver.solve({.rig = rig}).status, RigSolveStatus::too_few_tracks);

  Logged garbage(drive, 30);
  Random random(3);
  garbage.each_frame([&](auto& f) {
    for (auto& s : f.observations)
      for (auto& p : s.raw)
        p = Eigen::Vector2f(static_cast<float>(random.uniform(0, 1023)),
                            static_cast<float>(random.uniform(0, 767)));
  });
  const RigSolution g = garbage.solver.solve({.rig = rig});
  EXPECT_NE(g.status, RigSolveStatus::ok) << g.tracks << " tracks";
}

}  // namespace
}  // namespace vergence::test
