#include "core/calibration/gates.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/unit/core/calibration/feature_log.hpp"

namespace vergence::calibration {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

/// A question that every gate answers with `open`: frames 30 to 49 were not in the solve, and fit.
struct Case {
  test::FeatureDriveOptions drive;
  Arena arena;
  TrackLog log{60, 300, arena};
  CalibrationOptions options;
  RigCalibration nominal, in_use;
  RigSolution solution;
  AcceptanceInput question;

  Case() : Case(nullptr) {}
  explicit Case(const test::FurtherCamera& further) : Case(&further) {}
  explicit Case(const test::FurtherCamera* further) {
    test::FeatureDrive d(drive);
    test::log_drive(d, 50, {}, log, further);
    solution = {.status = RigSolveStatus::ok,
                .rig = further != nullptr ? test::rig_of(drive, *further) : test::rig_of(drive),
                .newest = 29,
                .frames = 30,
                .tracks = 900,
                .near = 500,
                .travelled_m = 8};
    for (std::size_t k = 1; k < static_cast<std::size_t>(solution.rig.cameras); ++k)
      solution.rig.sigma_noise[k] =
          solution.rig.sigma_total[k] = {1e-4, 1e-4, 1e-4, 1e-3, 2e-3, 2e-3};
    nominal = solution.rig;
    nominal.T_camera_left[1] = {Mat3::Identity(), {-0.75, 0, 0}};
    in_use = solution.rig;
    question.solution = &solution;
    question.nominal = &nominal;
    question.log = &log;
  }
  [[nodiscard]] Gate ask() const { return check_acceptance(question, options); }
  void turn(RigCalibration* rig, const Vec3& degrees, std::size_t camera = 1) const {
    Transform& T = rig->T_camera_left[camera];
    T = perturbed(T, kDegree * degrees, Vec3::Zero());
  }
  [[nodiscard]] Transform& found() { return solution.rig.T_camera_left[1]; }
};

TEST(Gates, unusableSolutionIsRejectedByItsGate) {
  struct Row {
    Gate gate;
    void (*change)(Case*);
  };
  for (const Row& row : {
           Row{Gate::not_solved,
               [](Case* c) { c->solution.status = RigSolveStatus::too_few_tracks; }},
           Row{Gate::not_solved,
               [](Case* c) { c->solution.status = RigSolveStatus::no_candidate; }},
           Row{Gate::not_solved,
               [](Case* c) { c->solution.status = RigSolveStatus::not_converged; }},
           Row{Gate::not_solved,
               [](Case* c) { c->solution.status = RigSolveStatus::not_observable; }},
           // Three baselines are 2.25 m.
           Row{Gate::needs_motion, [](Case* c) { c->solution.travelled_m = 2.24; }},
           Row{Gate::open, [](Case* c) { c->solution.travelled_m = 2.26; }},
           Row{Gate::needs_near_structure,
               [](Case* c) { c->solution.near = c->options.min_near_points - 1; }},
           Row{Gate::open, [](Case* c) { c->solution.near = c->options.min_near_points; }},
           Row{Gate::cameras_swapped, [](Case* c) { c->found() = c->found().inverse(); }},
           Row{Gate::out_of_sync, [](Case* c) { c->solution.lag_frames = 1; }},
       }) {
    Case c;
    row.change(&c);
    EXPECT_EQ(c.ask(), row.gate) << static_cast<int>(row.gate);
  }
}

// At 20 m, where f b / z is 27 px, a yaw of 1 mrad makes the depth wrong by 2.7 %: usable are 5 %.
TEST(Gates, depthErrorAboveUsableIsRefused) {
  for (const double share : {0.9, 1.1}) {
    Case c;
    c.options.reference_depth_m = 20;
    const auto excess = [&] { return depth_excess(c.solution.rig, c.options, 0.15); };
    c.solution.rig.sigma_noise[1] = {0, 1e-3, 0, 0, 0, 0};
    c.solution.rig.sigma_total[1] = c.solution.rig.sigma_noise[1];
    c.options.usable_depth_percent *= excess() / share;
    EXPECT_NEAR(excess(), share, 1e-9);
    EXPECT_EQ(c.ask(), share < 1 ? Gate::open : Gate::depth_unknown);
  }
}

TEST(Gates, directionBeyondTenDegreesIsImplausible) {
  Case c;
  for (const double degrees : {9.9, 10.1}) {
    const double a = degrees * kDegree;
    c.found().t = 0.75 * Vec3(-std::cos(a), 0, std::sin(a));
    EXPECT_EQ(c.ask() == Gate::implausible_direction, degrees > 10) << degrees;
  }
}

TEST(Gates, rotationBeyondTenDegreesIsImplausible) {
  for (const double degrees : {9.9, 10.1}) {
    Case c;
    c.nominal.T_camera_left[1].R = exp_so3(degrees * kDegree * Vec3(0, 0.6, 0.8)) * c.found().R;
    EXPECT_EQ(c.ask(), Gate::open)
        << "from scratch only the sign of t_x and the direction are asked";
    c.turn(&c.in_use, {0.3, 0, 0});
    c.question.in_use = &c.in_use;
    EXPECT_EQ(c.ask(), degrees > 10 ? Gate::implausible_rotation : Gate::open) << degrees;
  }
}

TEST(Gates, heldOutFramesRejectAWrongSolution) {
  Case c;
  // The rotation moves rows by 4.4 px; 1.5 px are allowed.
  c.turn(&c.solution.rig, {0.2, 0, 0});
  EXPECT_EQ(c.ask(), Gate::does_not_fit);
  const HeldOut h = held_out(c.log, c.solution.newest, c.solution.rig);
  EXPECT_NEAR(h.median_px, 1247 * 0.2 * kDegree, 0.3);
  // Without frames to tell, nothing contradicts it.
  c.solution.newest = 50 - kMinForMean;
  EXPECT_EQ(held_out(c.log, c.solution.newest, c.solution.rig).frames, kMinForMean - 1);
  EXPECT_EQ(c.ask(), Gate::open);
  EXPECT_FALSE(held_out_enough(c.log, c.solution.newest)) << "so no solve is decided then";
  EXPECT_TRUE(held_out_enough(c.log, c.solution.newest - 1));
}

TEST(Gates, heldOutFramesAreTheNewestTwelve) {
  const Case c;
  EXPECT_EQ(held_out(c.log, 29, c.solution.rig).frames, static_cast<int>(kHeldOutFrames));
  EXPECT_EQ(held_out(c.log, 44, c.solution.rig).frames, 5);
  EXPECT_EQ(held_out(c.log, 49, c.solution.rig).frames, 0);
  EXPECT_EQ(held_out(c.log, 49, c.solution.rig).median_px, 0);
}

TEST(Gates, solutionNoBetterThanInUseIsRejected) {
  Case c;
  c.question.in_use = &c.in_use;
  EXPECT_EQ(c.ask(), Gate::no_better) << "the same";
  c.turn(&c.solution.rig, {0.03, 0, 0});
  EXPECT_EQ(c.ask(), Gate::no_better) << "a worse one";
  std::swap(c.solution.rig.T_camera_left[1], c.in_use.T_camera_left[1]);
  EXPECT_EQ(c.ask(), Gate::open)
      << "the better one, by 0.65 px of row: many times the spread of a median of 150 matches";
}

const test::FurtherCamera kThird{2, {exp_so3({-6e-3, 4e-3, 2e-3}), {-0.6, -0.05, 0.01}}};

TEST(Gates, knockOfTheThirdCameraIsAccepted) {
  Case c(kThird);
  c.question.in_use = &c.in_use;
  EXPECT_EQ(c.ask(), Gate::no_better) << "the same";
  // The rotation moves rows by 8.7 px.
  c.turn(&c.in_use, {0.4, 0, 0}, 2);
  EXPECT_EQ(c.ask(), Gate::open);
  EXPECT_NEAR(held_out(c.log, c.solution.newest, c.in_use).median_px, 1247 * 0.4 * kDegree, 0.5)
      << "of the camera that fits worst";
  // Errors of two cameras, √2 · 0.45 px of a coordinate, have a median of 0.43 px, of outliers and
  // of tracks that have wandered more.
  EXPECT_LT(held_out(c.log, c.solution.newest, c.solution.rig).median_px, 1.0);
  const Assessment a = assess(c.solution.rig, c.in_use, CalibrationOrigin::elsewhere, c.log,
                              c.solution.newest, c.options, 0.15);
  EXPECT_TRUE(a.better);
  EXPECT_FALSE(a.worse);
  std::swap(c.solution.rig.T_camera_left[2], c.in_use.T_camera_left[2]);
  EXPECT_TRUE(fits_better(c.log, c.solution.newest, c.in_use, c.solution.rig));
  c.question.in_use = nullptr;
  EXPECT_EQ(c.ask(), Gate::does_not_fit) << "a solution with this third camera";
}

// A short drive holds every camera less well than a long one before it did: by what the gates take
// of a full window, 0.45 mrad, which is 0.56 px and no chance over twelve frames.
TEST(Gates, knockIsAcceptedDespiteALessCertainCamera) {
  for (const std::size_t knocked : {1U, 2U}) {
    Case c(kThird);
    c.question.in_use = &c.in_use;
    c.turn(&c.solution.rig, {0.45e-3 / kDegree, 0, 0}, 3 - knocked);
    EXPECT_TRUE(fits_better(c.log, c.solution.newest, c.in_use, c.solution.rig)) << knocked;
    EXPECT_EQ(c.ask(), Gate::no_better) << "nothing was knocked";
    c.turn(&c.in_use, {0.4, 0, 0}, knocked);
    EXPECT_EQ(c.ask(), Gate::open) << knocked;
  }
}

TEST(Gates, uncertainCameraHidesNoContradiction) {
  for (const std::size_t wrong : {1U, 2U}) {
    Case c(kThird);
    const std::size_t poor = 3 - wrong;
    const int yaw = extrinsic_row(static_cast<int>(poor)) + 1;
    // The sigma, in rad, exceeds the rotation below.
    constexpr double kUnknown = 0.01;
    c.solution.rig.covariance.set(yaw, yaw, kUnknown * kUnknown);
    const auto assessed = [&] {
      return assess(c.solution.rig, c.in_use, CalibrationOrigin::elsewhere, c.log,
                    c.solution.newest, c.options, 0.15);
    };
    ASSERT_FALSE(assessed().contradicted);
    c.turn(&c.in_use, {0, 0.3, 0}, wrong);
    EXPECT_TRUE(assessed().contradicted) << wrong;
    EXPECT_FALSE(assessed().verified);
  }
}

TEST(Gates, thirdCameraWithoutMatchesDecidesNothing) {
  Case c(kThird);
  for (std::size_t i = 0; i < c.log.size(); ++i)
    for (LoggedObservation& o : c.log.frame(i).observations) o.cameras = 0b011;
  c.question.in_use = &c.in_use;
  EXPECT_EQ(c.ask(), Gate::no_better);
  c.turn(&c.in_use, {0.03, 0, 0});
  EXPECT_EQ(c.ask(), Gate::open);
}

}  // namespace
}  // namespace vergence::calibration
