#include "core/geometry/pose_refine.hpp"

#include <limits>

#include "core/math/linear_solve.hpp"
#include "tests/unit/core/geometry/rig_scene.hpp"

namespace vergence {
namespace {

using test::make_scene;
using test::RigScene;

constexpr std::size_t kCapacity = 512;

class PoseRefinerTest : public testing::Test {
 protected:
  /// A point of make_rig(2)'s left frame, world = left, with noise of 0.3 px and `off_px` in u.
  void see_point(const Vec3& p_left, double off_px, Random& random) {
    const RigCalibration rig = test::make_rig(2);
    ASSERT_TRUE(table_.push(p_left, 0.3));
    for (int k = 0; k < 2; ++k) {
      const auto c = static_cast<std::size_t>(k);
      const Intrinsics& lens = rig.intrinsics[c];
      const Vec3 p = rig.T_camera_left[c] * p_left;
      table_.see(k, Vec2(lens.fx * p.x() / p.z() + lens.cx + off_px + 0.3 * random.normal(),
                         lens.fy * p.y() / p.z() + lens.cy + 0.3 * random.normal()));
    }
  }

  Arena arena_;
  PoseRefiner refiner_{kCapacity, arena_};
  RigObservationTable table_{kCapacity, arena_};
  detail::PoseProblem problem_{kCapacity, arena_, "test"};
};

Transform disturbed(const Transform& T, Random& random, double angle, double metres) {
  Vec6 d;
  d << test::random_vector(random, -angle, angle), test::random_vector(random, -metres, metres);
  return detail::moved(T, d);
}

/// δ = (φ, τ) of moved() that leads from a to b.
Vec6 step_between(const Transform& a, const Transform& b) {
  Vec6 d;
  const Mat3 turn = b.R * a.R.transpose();
  d << log_so3(turn), b.t - turn * a.t;
  return d;
}

TEST_F(PoseRefinerTest, gradientIsTheDerivativeOfTheCost) {
  // dC/dδ = −2 g, Huber's tail included; cost of some 1e4, so that central differences are good to
  // about 1e-5 of |g|.
  Random random(21);
  for (int cameras = 1; cameras <= kMaxCameras; ++cameras) {
    const RigScene scene = make_scene(random, cameras, 101, 0.2, 0.3, 0.3, 0.5, &table_);
    problem_.gather(table_.view());
    const Transform at = disturbed(scene.T_left_world, random, 0.003, 0.03);
    const detail::PoseProblem::Sums sums = problem_.sums(at, 1.3, 2.0);
    const double h = 1e-6;
    for (int i = 0; i < 6; ++i) {
      const double ahead = problem_.sums(detail::moved(at, h * Vec6::Unit(i)), 1.3, 2.0).cost;
      const double behind = problem_.sums(detail::moved(at, -h * Vec6::Unit(i)), 1.3, 2.0).cost;
      EXPECT_NEAR((ahead - behind) / (2 * h), -2.0 * sums.g[i], 1e-5 * sums.g.norm())
          << cameras << " cameras, column " << i;
    }
  }
}

/// Standard deviation of the position in its worst direction, in metres.
double translation_sigma(const RefinedPose& pose) {
  const Mat6 covariance = pose.information.inverse();
  return std::sqrt(semidefinite_eigenvalues<3>(covariance.bottomRightCorner<3, 3>())[0]);
}

TEST_F(PoseRefinerTest, nearOutliersDoNotMoveThePose) {
  // Three points at 7 m, wrong by 8 px the same way in both cameras, beside 150 right ones at 10 to
  // 60 m. The second round is the solve without them: the same to a hundredth of its sigma.
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Random random(seed);
    table_.clear();
    table_.set_rig(test::make_rig(2));
    std::vector<std::uint8_t> right;
    for (int i = 0; i < 153; ++i) {
      const bool good = i % 51 != 0;
      right.push_back(good ? 3 : 0);
      see_point(good ? test::visible_point(random, 10, 60) : test::visible_point(random, 6, 7),
                good ? 0.0 : 8.0, random);
    }
    const RefinedPose found = refiner_.refine(table_.view(), Transform{}, {}, true);
    const RefinedPose without = refiner_.refine(table_.view(), Transform{}, right, true);
    ASSERT_TRUE(found.usable && without.usable) << seed;
    const Vec6 apart = step_between(found.T_left_world, without.T_left_world);
    EXPECT_LT(apart.dot(without.information * apart), 1e-4) << seed;
    EXPECT_NEAR(found.scale, without.scale, 0.01);  // as it is after two steps from two starts

    const RefinedPose pulled = refiner_.refine(table_.view(), Transform{}, {}, false);
    EXPECT_GT((pulled.T_left_world.centre() - without.T_left_world.centre()).norm(),
              1.5 * translation_sigma(without))
        << seed;
  }
}

TEST_F(PoseRefinerTest, informationPredictsTheSpreadOfThePose) {
  // Normalised squared error: 6 in the mean without a robust loss. Huber's with threshold k weights
  // Gaussian residuals of length r by E[w] = 1 − e^(−k²/2) + k √(2π) (1 − Φ(k)) = 0.90, and the
  // covariance is (1 − e^(−k²/2)) / ((1 − e^(−k²/2) + E[w]) / 2)² = 1.07 of that without: 5.75.
  // 200 draws know the mean to 0.25.
  double nees = 0, rms = 0;
  constexpr int kDraws = 200;
  for (int k = 0; k < kDraws; ++k) {
    Random random(1000 + static_cast<std::uint64_t>(k));
    const RigScene scene = make_scene(random, 2, 150, 0.0, 0.3, 0.4, 0.4, &table_);
    const RefinedPose found = refiner_.refine(table_.view(), scene.T_left_world, {}, true);
    ASSERT_TRUE(found.usable);
    const Vec6 d = step_between(found.T_left_world, scene.T_left_world);
    nees += d.dot(found.information * d) / kDraws;
    rms += found.rms_px / kDraws;
  }
  EXPECT_NEAR(nees, 5.75, 0.75);
  EXPECT_NEAR(rms, 0.4, 0.02);  // the 1 % beyond the χ² threshold are not in it
}

TEST_F(PoseRefinerTest, onlySelectedObservationsAreUsed) {
  Random random(25);
  const RigScene scene = make_scene(random, 2, 100, 0.4, 0.0, 0.0, 0.3, &table_);
  std::vector<std::uint8_t> use(100, 0);
  for (std::size_t i = 0; i < 100; ++i) use[i] = scene.good[i] ? 3 : 0;
  const RefinedPose found =
      refiner_.refine(table_.view(), disturbed(scene.T_left_world, random, 0.02, 0.2), use, true);
  EXPECT_LT(test::difference(found.T_left_world, scene.T_left_world), 1e-9);
  for (std::size_t i = 0; i < 100; ++i) EXPECT_EQ(refiner_.flags()[i] == 3, scene.good[i]) << i;
}

TEST_F(PoseRefinerTest, invalidInputHasNoPose) {
  Random random(26);
  const RigScene scene = make_scene(random, 1, 2, 0.0, 0.0, 0.0, 0.3, &table_);
  EXPECT_FALSE(refiner_.refine(table_.view(), scene.T_left_world, {}, true).usable);
  (void)make_scene(random, 2, 50, 0.0, 0.0, 0.0, 0.3, &table_);
  Transform bad;
  bad.t.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(refiner_.refine(table_.view(), bad, {}, true).usable);
  const std::vector<std::uint8_t> use(3, 1);
  EXPECT_FALSE(refiner_.refine(table_.view(), Transform{}, use, true).usable);
  Arena small_arena;
  PoseRefiner small(20, small_arena);
  EXPECT_FALSE(small.refine(table_.view(), Transform{}, {}, true).usable);

  table_.clear();  // all points on one line: the turn about it is free
  for (int i = 0; i < 50; ++i) {
    ASSERT_TRUE(table_.push(Vec3(0.1 * i, 0, 10), 0.3));
    table_.see(0, Vec2(318 + 5.2 * i, 243));
  }
  EXPECT_FALSE(refiner_.refine(table_.view(), Transform{}, {}, true).usable);
  table_.clear();  // and all behind the camera
  for (int i = 0; i < 50; ++i) {
    ASSERT_TRUE(table_.push(test::visible_point(random, -9, -2), 0.3));
    table_.see(0, Vec2(318, 243));
  }
  EXPECT_FALSE(refiner_.refine(table_.view(), Transform{}, {}, true).usable);
}

}  // namespace
}  // namespace vergence
