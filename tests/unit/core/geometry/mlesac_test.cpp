#include "core/geometry/mlesac.hpp"

#include <limits>

#include "tests/unit/core/geometry/rig_scene.hpp"

namespace vergence {
namespace {

using namespace test;

constexpr std::size_t kCapacity = 512;

class RigMlesacTest : public testing::Test {
 protected:
  Arena arena_;
  RigMlesac mlesac_{kCapacity, arena_};
  RigObservationTable table_{kCapacity, arena_};
};

double share_flagged_right(const RigScene& scene, const RigObservations& o,
                           std::span<const std::uint8_t> flags) {
  int right = 0;
  for (std::size_t i = 0; i < o.size(); ++i)
    right += (flags[i] == o.seen[i]) == scene.good[i] ? 1 : 0;
  return static_cast<double>(right) / static_cast<double>(o.size());
}

TEST_F(RigMlesacTest, poseAmongHalfOutliersIsFoundAndFlagged) {
  // T² = 9.21 alone calls 1 % of good pixels wrong, 2 % of points seen twice; three-point poses
  // carry noise of their own, so the stated sigma is three times the true one.
  int poses = 0;
  for (std::uint64_t seed = 1; seed <= 50; ++seed) {
    Random random(seed);
    const RigScene scene = make_scene(random, 2, 300, 0.5, 0.3, 0.3, 0.9, &table_);
    const MlesacPose found = mlesac_.solve(table_.view(), {}, nullptr, random);
    ASSERT_TRUE(found.found);
    EXPECT_GE(share_flagged_right(scene, table_.view(), mlesac_.flags()), 0.98) << "seed " << seed;
    EXPECT_LT(rotation_angle(found.T_left_world.R * scene.T_left_world.R.transpose()), 0.02);
    if ((found.T_left_world.centre() - scene.T_left_world.centre()).norm() < 0.2) ++poses;
  }
  EXPECT_GE(poses, 48);
}

TEST_F(RigMlesacTest, pointsSeenByOneCameraGiveThePose) {
  Random random(8);
  const RigScene scene = make_scene(random, 2, 60, 0.0, 0.0, 0.0, 0.3, &table_);
  RigObservations o = table_.view();
  std::vector<std::uint8_t> right_only(o.size(), 2);
  o.seen = right_only;
  const MlesacPose found = mlesac_.solve(o, {}, nullptr, random);
  ASSERT_TRUE(found.found);
  EXPECT_LT(test::difference(found.T_left_world, scene.T_left_world), 1e-9);
  EXPECT_EQ(found.inliers, 60);
}

TEST_F(RigMlesacTest, goodPriorEndsEarlyAndBadOneDoesNoHarm) {
  Random random(10);
  const RigScene scene = make_scene(random, 2, 300, 0.1, 0.3, 0.3, 0.6, &table_);
  MlesacOptions options{.max_hypotheses = 1000};
  const MlesacPose good = mlesac_.solve(table_.view(), options, &scene.T_left_world, random);
  EXPECT_TRUE(good.found);
  // With w ≥ 0.88, ln 1e-3 / ln(1 − w³) is at most 6; min_hypotheses is 8.
  EXPECT_LE(good.samples, 12);
  const Transform far{exp_so3({1, 1, 1}), {50, 0, 0}};
  const MlesacPose bad = mlesac_.solve(table_.view(), options, &far, random);
  EXPECT_LT(rotation_angle(bad.T_left_world.R * scene.T_left_world.R.transpose()), 0.02);
}

TEST_F(RigMlesacTest, invalidInputHasNoPose) {
  Random random(13);
  (void)make_scene(random, 2, 2, 0.0, 0.0, 0.0, 0.3, &table_);
  EXPECT_FALSE(mlesac_.solve(table_.view(), {}, nullptr, random).found);
  const Transform prior;
  // The prior is the only hypothesis.
  EXPECT_TRUE(mlesac_.solve(table_.view(), {}, &prior, random).found);
  table_.clear();
  EXPECT_FALSE(mlesac_.solve(table_.view(), {}, &prior, random).found);

  (void)make_scene(random, 2, 50, 0.0, 0.0, 0.0, 0.3, &table_);
  RigObservations o = table_.view();
  o.sigma = o.sigma.first(10);
  EXPECT_FALSE(mlesac_.solve(o, {}, nullptr, random).found);
  o = table_.view();
  o.pinhole[1].fx = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(mlesac_.solve(o, {}, nullptr, random).found);
  o = table_.view();
  o.cameras = kMaxCameras + 1;
  EXPECT_FALSE(mlesac_.solve(o, {}, nullptr, random).found);
  MlesacOptions options{.confidence = 1.0};
  EXPECT_FALSE(mlesac_.solve(table_.view(), options, nullptr, random).found);

  Arena small_arena;
  RigMlesac small(20, small_arena);
  EXPECT_FALSE(small.solve(table_.view(), {}, nullptr, random).found);

  table_.clear();
  // All points are on one line, so no sample has a pose.
  for (int i = 0; i < 50; ++i) {
    ASSERT_TRUE(table_.push(Vec3(0.1 * i, 0, 10), 0.3));
    table_.see(0, Vec2(318 + 5.2 * i, 243));
  }
  EXPECT_FALSE(mlesac_.solve(table_.view(), {}, nullptr, random).found);
}

TEST_F(RigMlesacTest, nonFiniteObservationsAreIgnored) {
  Random random(14);
  const RigScene scene = make_scene(random, 2, 100, 0.0, 0.0, 0.0, 0.3, &table_);
  ASSERT_TRUE(table_.push(Vec3(std::numeric_limits<double>::quiet_NaN(), 0, 0), 0.3));
  table_.see(0, Vec2(10, 10));
  ASSERT_TRUE(table_.push(Vec3(0, 0, 5), 0.0));
  table_.see(0, Vec2(10, 10));
  ASSERT_TRUE(table_.push(Vec3(0, 0, std::numeric_limits<double>::infinity()), 0.3));
  table_.see(1, Vec2(std::numeric_limits<double>::infinity(), 10));
  const MlesacPose found = mlesac_.solve(table_.view(), {}, nullptr, random);
  EXPECT_LT(test::difference(found.T_left_world, scene.T_left_world), 1e-9);
  EXPECT_EQ(found.inliers, 100);
}

}  // namespace
}  // namespace vergence
