#include "core/bundle/bundle.hpp"

#include <gtest/gtest.h>

#include "tests/support/simd_targets.hpp"
#include "tests/unit/core/bundle/bundle_fixture.hpp"

namespace vergence {
namespace {

// Rounding of a pixel near 1000 is 1e-13 px; of a 25 m coordinate 4e-15 m. A direction as weak as a
// rig's depth loses three digits more.
constexpr double kExactPixel = 1e-11, kExactMetre = 1e-10, kExactRadian = 1e-11;

TEST(Bundle, calibrationIsExactOnNoiseFreeData) {
  SimulationOptions s{.generator = SimulationGenerator::tight,
                      .noise = 0,
                      .start_translation = 0.5,
                      .start_points = -1};
  SequentialRunner runner;
  OwnAdjuster whole(capacities_for(s)), halves(capacities_for(s), &runner);
  Random random(11);
  for (int run = 0; run < 100; ++run) {
    SimulatedRig rig = simulate_rig(s, random);
    const BundleResult r =
        (run % 2 == 0 ? whole : halves).adjuster.solve(rig.problem(), calibration_options());
    ASSERT_TRUE(r.converged()) << run;
    EXPECT_LT(r.rms_px, kExactPixel) << run;
    EXPECT_LT(rotation_error(rig, 1), kExactRadian) << run;
    EXPECT_LT(translation_error(rig, 1), kExactMetre) << run;
    EXPECT_LT(pose_error(rig), kExactMetre) << run;
  }
}

TEST(Bundle, monocularPosesAreExactUpToScale) {
  SimulationOptions s{.noise = 0};
  OwnAdjuster own(capacities_for(s));
  BundleOptions options{.configuration = BundleConfiguration::parallel_monocular};
  Random random(14);
  for (int run = 0; run < 20; ++run) {
    SimulatedRig rig = simulate_rig(s, random);
    std::vector<Transform> images;
    std::vector<BundleObservation> observations;
    std::vector<std::uint8_t> constant;
    const BundleResult r =
        own.adjuster.solve(monocular_problem(&rig, &images, &observations, &constant), options);
    ASSERT_TRUE(r.converged());
    EXPECT_LT(r.rms_px, kExactPixel);
    const Transform& newest_left = images[images.size() - 2];
    const Transform T_right_left = images.back() * newest_left.inverse();
    const double scale = rig.true_cameras[1].t.norm() / T_right_left.t.norm();
    EXPECT_LT(rotation_angle(T_right_left.R * rig.true_cameras[1].R.transpose()), kExactRadian);
    EXPECT_LT((scale * T_right_left.t - rig.true_cameras[1].t).norm(), kExactMetre);
  }
}

TEST(Bundle, squaredResidualsAreWhitened) {
  // The number of points is not a multiple of the batch.
  Simulated s(18, {.points = 37});
  SimulatedRig& rig = s.rig;
  std::vector<float> squared(rig.observations.size());
  BundleProblem p = rig.problem();
  p.squared_residuals = squared;
  ASSERT_TRUE(s.own.adjuster.solve(p, calibration_options()).converged());
  for (std::size_t i = 0; i < squared.size(); ++i) {
    const BundleObservation& o = rig.observations[i];
    Vec2 pixel;
    ASSERT_EQ(rig.cameras[0].project(
                  rig.T_camera_left[o.camera] * (rig.T_left_world[o.pose] * rig.points[o.point]),
                  &pixel, nullptr),
              ProjectStatus::ok);
    const double expected =
        (pixel - Vec2(o.x, o.y)).squaredNorm() * o.inverse_sigma * o.inverse_sigma;
    EXPECT_NEAR(squared[i], expected, 1e-5 * (1 + expected)) << i;
  }
}

TEST(Bundle, constantPosesAreUnchanged) {
  Simulated s(19);
  SimulatedRig& rig = s.rig;
  const SimulatedRig before = rig;
  std::vector<std::uint8_t> pose_constant(10, 0);
  pose_constant[0] = pose_constant[4] = 1;
  BundleProblem p = rig.problem();
  p.pose_constant = pose_constant;
  ASSERT_TRUE(s.own.adjuster.solve(p, calibration_options()).usable());
  EXPECT_EQ(rig.T_left_world[4].t, before.T_left_world[4].t);
  EXPECT_NE(rig.points[4], before.points[4]);
  EXPECT_NE(rig.T_left_world[5].t, before.T_left_world[5].t);
}

TEST(Bundle, pointsAreFoundWithEveryPoseConstant) {
  Simulated s(24, {.noise = 0});
  SimulatedRig& rig = s.rig;
  rig.T_camera_left = rig.true_cameras;
  rig.T_left_world = rig.true_poses;
  const std::vector<std::uint8_t> constant(rig.T_left_world.size(), 1);
  BundleProblem p = rig.problem();
  p.pose_constant = constant;
  const BundleResult r = s.own.adjuster.solve(p, {});
  ASSERT_TRUE(r.converged());
  for (std::size_t i = 0; i < rig.points.size(); ++i)
    EXPECT_LT((rig.points[i] - rig.true_points[i]).norm(), kExactMetre);
}

TEST(Bundle, everyTerminationIsReached) {
  Simulated s(23);
  const auto end = [&](const BundleOptions& o) {
    SimulatedRig rig = s.rig;
    return s.own.adjuster.solve(rig.problem(), o).termination;
  };
  BundleOptions o = calibration_options();
  EXPECT_EQ(end(o), BundleTermination::converged);
  o.max_steps = 1;
  EXPECT_EQ(end(o), BundleTermination::max_steps);
  o = calibration_options();
  // Nothing fixes the scale.
  o.length[1].kind = BundleLength::free;
  EXPECT_EQ(end(o), BundleTermination::rank_deficient);
  o.loss_threshold = -1;
  EXPECT_EQ(end(o), BundleTermination::invalid_input);
}

/// The adjuster's kernels sum in another order on each target, and some fuse products with sums, so
/// that the last step may be one more; the optimum is the same within the tolerance.
TEST(BundleTargets, everySimdTargetFindsTheSameOptimum) {
  Simulated s(22, {.points = 61});
  SimulatedRig reference = s.rig;
  BundleOptions o = calibration_options();
  o.tolerance_sigmas = 1e-4;
  const BundleResult expected = s.own.adjuster.solve(reference.problem(), o);
  test::on_every_target([&](const char* target) {
    SimulatedRig rig = s.rig;
    const BundleResult r = s.own.adjuster.solve(rig.problem(), o);
    // Half of the squared distance in standard deviations, and 2440 squares in another order.
    EXPECT_NEAR(r.final_cost, expected.final_cost, 1e-12 * expected.final_cost) << target;
    // Standard deviations are of some millimetres.
    EXPECT_LT((rig.T_camera_left[1].t - reference.T_camera_left[1].t).norm(), 1e-6) << target;
    for (std::size_t i = 0; i < rig.T_left_world.size(); ++i)
      EXPECT_LT((rig.T_left_world[i].centre() - reference.T_left_world[i].centre()).norm(), 1e-6)
          << target << ", rig " << i;
  });
}

}  // namespace
}  // namespace vergence
