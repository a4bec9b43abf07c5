// Prior of a rig from earlier solves, and the covariance that one solve hands to the next.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <limits>

#include "tests/unit/core/bundle/bundle_fixture.hpp"

namespace vergence {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// To the very minimum.
BundleOptions to_the_minimum() {
  BundleOptions o = with_covariance();
  o.tolerance_sigmas = 1e-6;
  return o;
}

RigCalibration calibration_of(const SimulatedRig& rig, const RigCovariance& covariance) {
  RigCalibration c{.cameras = static_cast<int>(rig.cameras.size())};
  for (std::size_t k = 0; k < rig.cameras.size(); ++k) {
    c.intrinsics[k] = rig.cameras[k].intrinsics();
    c.T_camera_left[k] = rig.T_camera_left[k];
  }
  c.covariance = covariance;
  return c;
}

/// One problem, solved without a prior: what its tracks alone say.
struct Alone {
  SimulationOptions simulation = tight(100);
  OwnAdjuster own{capacities_for(simulation)};
  SimulatedRig start, solved;
  BundleOptions options = to_the_minimum();
  BundleResult result;

  explicit Alone(std::uint64_t seed) {
    Random random(seed);
    start = solved = simulate_rig(simulation, random);
    result = own.adjuster.solve(solved.problem(), options);
  }
  [[nodiscard]] SimulatedRig with(const RigCalibration& known, BundleResult* r) {
    SimulatedRig rig = start;
    BundleOptions o = options;
    o.shared_prior.rig = &known;
    *r = own.adjuster.solve(rig.problem(), o);
    return rig;
  }
};

/// Two drives with one rig: five frames see one half of the points, the next five, begun at a known
/// pose, the other half.
struct TwoHalves {
  static constexpr int kPoints = 600;
  SimulationOptions simulation = tight(kPoints);
  OwnAdjuster own{capacities_for(simulation)};
  SimulatedRig all;
  std::vector<std::uint8_t> constant;

  explicit TwoHalves(std::uint64_t seed) {
    Random random(seed);
    all = simulate_rig(simulation, random);
    all.T_left_world[5] = all.true_poses[5];
    std::erase_if(all.observations, [](const BundleObservation& o) {
      return (o.pose < 5) != (o.point < kPoints / 2);
    });
  }
  /// `which`: 1, 2, or 3 for both.
  [[nodiscard]] BundleResult solve(unsigned which, const BundleOptions& o, SimulatedRig* rig) {
    *rig = all;
    std::erase_if(rig->observations, [&](const BundleObservation& s) {
      return (which & (s.pose < 5 ? 1U : 2U)) == 0;
    });
    constant.assign(10, 0);
    for (std::size_t i = 0; i < 10; ++i)
      constant[i] = i % 5 == 0 || (which & (i < 5 ? 1U : 2U)) == 0 ? 1 : 0;
    BundleProblem problem = rig->problem();
    problem.pose_constant = constant;
    return own.adjuster.solve(problem, o);
  }
};

/// The second half with the first one's covariance as its prior against all at once. The prior is
/// the covariance by 300 tracks instead of the information itself: its variances are off by
/// √(2/300) = 8 %, some more in the worst of six directions. That shifts the weight between the
/// halves by no more, and their distance is √2 of each one's sigma, twice that of both: 0.3 of the
/// latter is several times the shift.
TEST(BundleSharedPrior, sequentialHalvesMatchBothTogether) {
  BundleOptions first = to_the_minimum();
  first.intrinsics[1].free = 0b1;
  first.intrinsics[1].prior_mean[0] = 886;
  first.intrinsics[1].prior_sigma[0] = 20;
  TwoHalves h(73);
  SimulatedRig one, alone, two, both;
  const BundleResult r1 = h.solve(1, first, &one), r2 = h.solve(2, first, &alone),
                     r = h.solve(3, first, &both);
  ASSERT_TRUE(r1.converged() && r2.converged() && r.converged());
  const RigCalibration known = calibration_of(one, r1.covariance);
  BundleOptions second = first;
  // The first half's covariance replaces the prior.
  second.intrinsics[1].prior_sigma[0] = 0;
  second.shared_prior.rig = &known;
  const BundleResult after = h.solve(2, second, &two);
  ASSERT_TRUE(after.converged() && after.has_covariance);
  const auto compare = [&](int row, double difference) {
    const double variance = r.covariance(row, row);
    EXPECT_LT(std::abs(difference), 0.3 * std::sqrt(variance)) << row;
    EXPECT_LT(after.covariance(row, row), r1.covariance(row, row)) << row;
    EXPECT_LT(after.covariance(row, row), r2.covariance(row, row)) << row;
    EXPECT_NEAR(after.covariance(row, row) / variance, 1.0, 0.3) << row;
  };
  const Vec6 off = way(both.T_camera_left[1], two.T_camera_left[1]);
  for (int i = 0; i < 6; ++i) {
    // Row 3 is along the baseline, whose length is exact.
    if (i == 3) continue;
    compare(extrinsic_row(1) + i, off[i]);
  }
  compare(intrinsic_row(1), two.cameras[1].intrinsics().fx - both.cameras[1].intrinsics().fx);
}

// Seen twice with the same tracks: at a weight of two they count half as much as what is known, so
// that where the solve ends moves from the middle to a third of the way.
TEST(BundleSharedPrior, weightSetsTheShareOfThePrior) {
  Alone a(74);
  ASSERT_TRUE(a.result.converged() && a.result.has_covariance);
  const Vec6 sigma = a.result.covariance_noise[1].diagonal().cwiseSqrt();
  RigCalibration known = calibration_of(a.solved, a.result.covariance);
  known.T_camera_left[1].R = exp_so3(Vec3(0, 4 * sigma[1], 0)) * known.T_camera_left[1].R;
  double last = 0;
  for (const double weight : {0.25, 1.0, 4.0}) {
    SimulatedRig rig = a.start;
    BundleOptions o = a.options;
    o.shared_prior = {&known, weight};
    const BundleResult r = a.own.adjuster.solve(rig.problem(), o);
    ASSERT_TRUE(r.converged());
    const double share = way(a.solved.T_camera_left[1], rig.T_camera_left[1])[1] / (4 * sigma[1]);
    // w / (1 + w), the variance by a hundred tracks being 14 % uncertain, and more in directions
    // that are hardly seen.
    EXPECT_NEAR(share, weight / (1 + weight), 0.2) << weight;
    // The prior's error is independent of its weight: (1 + w²) / (1 + w)² of the tracks' variance.
    EXPECT_NEAR(r.covariance_noise[1](1, 1) / (sigma[1] * sigma[1]),
                (1 + weight * weight) / ((1 + weight) * (1 + weight)), 0.2)
        << weight;
    EXPECT_GT(share, last);
    last = share;
  }
}

TEST(BundleCovariance, jointCovarianceContainsTotalAndNoise) {
  Alone a(75);
  SimulatedRig rig = a.start;
  BundleOptions o = a.options;
  o.intrinsics[1].free = 0b1;
  o.intrinsics[1].prior_mean[0] = rig.cameras[1].intrinsics().fx;
  o.intrinsics[1].prior_sigma[0] = 1;
  o.intrinsics[0].held_sigma = {0.9, 0.9, 0.5, 0.5};
  o.intrinsics[1].held_sigma = {0, 0.8, 0.3, 0.4, 1e-3};
  const BundleResult r = a.own.adjuster.solve(rig.problem(), o);
  ASSERT_TRUE(r.converged() && r.has_covariance);
  std::vector<int> held;
  for (int k = 0; k < 2; ++k)
    for (int i = 0; i < kIntrinsicsSize; ++i) {
      const double sigma =
          o.intrinsics[static_cast<std::size_t>(k)].held_sigma[static_cast<std::size_t>(i)];
      if (!(sigma > 0)) continue;
      held.push_back(intrinsic_row(k) + i);
      EXPECT_NEAR(r.covariance(held.back(), held.back()), sigma * sigma, 1e-12 * sigma * sigma);
    }
  EXPECT_GT(r.covariance(intrinsic_row(1), intrinsic_row(1)), 0) << "the free one";
  const auto n = static_cast<Eigen::Index>(held.size());
  Eigen::MatrixXd C_held(n, n), cross(6, n);
  Mat6 block;
  for (Eigen::Index j = 0; j < n; ++j) {
    for (Eigen::Index i = 0; i < n; ++i)
      C_held(i, j) =
          r.covariance(held[static_cast<std::size_t>(i)], held[static_cast<std::size_t>(j)]);
    for (int i = 0; i < 6; ++i)
      cross(i, j) = r.covariance(extrinsic_row(1) + i, held[static_cast<std::size_t>(j)]);
  }
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 6; ++j)
      block(i, j) = r.covariance(extrinsic_row(1) + i, extrinsic_row(1) + j);
  // Sums of some ten products of the same doubles in another order.
  EXPECT_LT((block - r.covariance_total[1]).norm(), 1e-12 * r.covariance_total[1].norm());
  const Mat6 given = block - cross * C_held.ldlt().solve(cross.transpose());
  // The difference is up to 1e4 times smaller than its terms: as many digits less.
  EXPECT_LT((given - r.covariance_noise[1]).norm(), 1e-10 * r.covariance_total[1].norm());
  EXPECT_GT(r.covariance_total[1].trace(), 2 * r.covariance_noise[1].trace())
      << "otherwise nothing was shown";
}

TEST(BundleSharedPrior, invalidPriorKeepsTheResultFinite) {
  Alone a(77);
  a.options.intrinsics[1].free = 0b1111;
  a.options.intrinsics[1].prior_sigma = {1, 1, 1, 1};
  const Intrinsics& lens = a.start.cameras[1].intrinsics();
  a.options.intrinsics[1].prior_mean = {lens.fx, lens.fy, lens.cx, lens.cy};
  SimulatedRig once = a.start;
  const BundleResult own = a.own.adjuster.solve(once.problem(), a.options);
  ASSERT_TRUE(own.converged() && own.has_covariance);
  const RigCalibration good = calibration_of(once, own.covariance);
  std::vector<RigCalibration> hostile(9, good);
  for (const double bad : {kNan, std::numeric_limits<double>::infinity()}) {
    hostile[0].covariance.set(1, 1, bad);
    hostile[1].covariance.set(0, 1, bad);
    hostile[2].covariance.set(intrinsic_row(1), intrinsic_row(1), bad);
    hostile[3].covariance.set(1, intrinsic_row(1), bad);
    hostile[4].T_camera_left[1].t.x() = bad;
    hostile[5].T_camera_left[1].R(0, 1) = bad;
    hostile[6].intrinsics[1].fx = bad;
    // A correlation above 1 is no covariance.
    hostile[7].covariance.set(0, 1, 1e9);
    hostile[8].covariance.set(1, 1, -1);
    for (std::size_t i = 0; i < hostile.size(); ++i) {
      BundleResult r;
      const SimulatedRig found = a.with(hostile[i], &r);
      EXPECT_TRUE(found.T_camera_left[1].finite()) << i;
      EXPECT_TRUE(std::isfinite(found.cameras[1].intrinsics().fx)) << i;
      EXPECT_TRUE(std::isfinite(r.final_cost)) << i;
      EXPECT_TRUE(r.covariance_total[1].allFinite()) << i;
      for (const Vec3& p : found.points) ASSERT_TRUE(p.allFinite()) << i;
    }
  }
}

}  // namespace
}  // namespace vergence
