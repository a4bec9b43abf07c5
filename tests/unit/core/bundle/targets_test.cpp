#include <gtest/gtest.h>

#include "core/bundle/bundle.hpp"
#include "tests/support/simd_targets.hpp"
#include "tests/unit/core/bundle/bundle_fixture.hpp"

namespace vergence {
namespace {

/// The adjuster's kernels sum in another order on each target, and some fuse products with sums:
/// the optimum is the same to rounding, and so is the number of steps to it.
TEST(BundleTargets, everySimdTargetFindsTheSameOptimum) {
  Simulated s(22, {.points = 61});
  SimulatedRig reference = s.rig;
  BundleOptions o = calibration_options();
  o.tolerance_sigmas = 1e-6;
  const BundleResult expected = s.own.adjuster.solve(reference.problem(), o);
  test::on_every_target([&](const char* target) {
    SimulatedRig rig = s.rig;
    const BundleResult r = s.own.adjuster.solve(rig.problem(), o);
    EXPECT_EQ(r.steps, expected.steps) << target;
    // Sums of 2440 squares in another order: about √2440 roundings of 1e-16.
    EXPECT_NEAR(r.final_cost, expected.final_cost, 1e-12 * expected.final_cost) << target;
    // The last step is less than 1e-6 standard deviations, which are of some millimetres.
    EXPECT_LT((rig.T_camera_left[1].t - reference.T_camera_left[1].t).norm(), 1e-8) << target;
    for (std::size_t i = 0; i < rig.T_left_world.size(); ++i)
      EXPECT_LT((rig.T_left_world[i].centre() - reference.T_left_world[i].centre()).norm(), 1e-8)
          << target << ", rig " << i;
  });
}

}  // namespace
}  // namespace vergence
