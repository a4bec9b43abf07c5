#include "core/geometry/mlesac.hpp"

#include <limits>

#include "core/geometry/stereo_mlesac.hpp"
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

constexpr std::size_t kMatches = 600;
// One pixel in normalised units.
constexpr double kPixel = 1.0 / 600;
constexpr double kBaseline = 0.75;

struct MatchSet {
  Transform T_right_left;
  std::vector<double> left_x, left_y, right_x, right_y, sigma;
  std::vector<bool> good;
  [[nodiscard]] StereoMatches view() const { return {left_x, left_y, right_x, right_y, sigma}; }
};

/// A street-like pair: depths 3 … 60 m, rig turned by up to 0.1 rad from parallel; outliers
/// anywhere in the right image.
MatchSet make_matches(Random& random, int n, double outliers, double noise_px) {
  MatchSet m;
  m.T_right_left.R = exp_so3(test::random_vector(random, -0.1, 0.1));
  m.T_right_left.t =
      kBaseline * Vec3(-1, random.uniform(-0.1, 0.1), random.uniform(-0.1, 0.1)).normalized();
  for (int i = 0; i < n; ++i) {
    const Vec3 p = test::visible_point(random, 3, 60), q = m.T_right_left * p;
    const bool good = !(random.uniform() < outliers);
    m.left_x.push_back(p.x() / p.z() + noise_px * kPixel * random.normal());
    m.left_y.push_back(p.y() / p.z() + noise_px * kPixel * random.normal());
    m.right_x.push_back(good ? q.x() / q.z() + noise_px * kPixel * random.normal()
                             : random.uniform(-0.6, 0.6));
    m.right_y.push_back(good ? q.y() / q.z() + noise_px * kPixel * random.normal()
                             : random.uniform(-0.45, 0.45));
    m.sigma.push_back(std::max(noise_px, 0.1) * kPixel);
    m.good.push_back(good);
  }
  return m;
}

/// δ of moved_on_sphere() that leads from a to b, first order in the direction.
Vec5 step_between(const Transform& a, const Transform& b) {
  Vec5 d;
  d << log_so3(b.R * a.R.transpose()),
      tangent_basis(a.t.normalized()).transpose() * b.t.normalized();
  return d;
}

class StereoMlesacTest : public testing::Test {
 protected:
  Arena arena_;
  StereoMlesac mlesac_{kMatches, arena_};
};

TEST_F(StereoMlesacTest, exactMatchesGiveTheExactTransform) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Random random(seed);
    const MatchSet m = make_matches(random, 100, 0.0, 0.0);
    const StereoEstimate found = mlesac_.estimate_stereo_transform(m.view(), kBaseline, {}, random);
    ASSERT_TRUE(found.found);
    EXPECT_LT(test::difference(found.T_right_left, m.T_right_left), 1e-9) << seed;
    EXPECT_EQ(found.inliers, 100);
  }
}

TEST_F(StereoMlesacTest, transformIsFoundAmongFortyPercentOutliers) {
  // By chance an outlier lies within the epipolar band of ±2.6·√2 sigmas of 0.3 px in under 1 % of
  // the cases (540 px high images), half of them in front; χ² leaves 1 % of the good ones out.
  int close = 0, flagged = 0;
  constexpr int kRuns = 30;
  for (std::uint64_t seed = 1; seed <= kRuns; ++seed) {
    Random random(seed);
    const MatchSet m = make_matches(random, 400, 0.4, 0.3);
    const StereoEstimate found = mlesac_.estimate_stereo_transform(m.view(), kBaseline, {}, random);
    ASSERT_TRUE(found.found);
    EXPECT_NEAR(found.T_right_left.t.norm(), kBaseline, 1e-12);
    int right = 0;
    for (std::size_t i = 0; i < m.good.size(); ++i)
      right += (mlesac_.flags()[i] != 0) == m.good[i] ? 1 : 0;
    flagged += right >= 392 ? 1 : 0;
    const Vec5 d = step_between(found.T_right_left, m.T_right_left);
    EXPECT_LT(d.head<3>().norm(), 0.01) << seed;
    close += d.tail<2>().norm() < 4 * found.direction_sigma ? 1 : 0;
  }
  // At least 98 % must be right. A search that ends in a side valley of the cost loses more.
  EXPECT_GE(flagged, kRuns - 2);
  // An outlier of large disparity on the right line looks like a match and strongly moves t.
  EXPECT_GE(close, kRuns - 3);
}

TEST_F(StereoMlesacTest, informationPredictsTheErrorOfMostRuns) {
  int within = 0;
  constexpr int kRuns = 60;
  for (std::uint64_t seed = 1; seed <= kRuns; ++seed) {
    Random random(200 + seed);
    const MatchSet m = make_matches(random, 300, 0.0, 0.3);
    const StereoEstimate found = mlesac_.estimate_stereo_transform(m.view(), kBaseline, {}, random);
    ASSERT_TRUE(found.found);
    const Vec5 d = step_between(found.T_right_left, m.T_right_left);
    // The bound is the 99 % quantile of χ²(5).
    within += d.dot(found.information * d) < 15.09 ? 1 : 0;
  }
  // A sampled search may end in a side valley of the truncated cost.
  EXPECT_GE(within, kRuns * 9 / 10);
}

TEST_F(StereoMlesacTest, invalidInputFailsAndNonFiniteIsIgnored) {
  Random random(11);
  MatchSet m = make_matches(random, 4, 0, 0);
  EXPECT_FALSE(mlesac_.estimate_stereo_transform(m.view(), kBaseline, {}, random).found);
  EXPECT_FALSE(mlesac_.estimate_stereo_transform({}, kBaseline, {}, random).found);
  m = make_matches(random, 50, 0, 0);
  EXPECT_FALSE(mlesac_.estimate_stereo_transform(m.view(), 0.0, {}, random).found);
  StereoMatches short_one = m.view();
  short_one.sigma = short_one.sigma.first(3);
  EXPECT_FALSE(mlesac_.estimate_stereo_transform(short_one, kBaseline, {}, random).found);
  Arena small_arena;
  StereoMlesac small(20, small_arena);
  EXPECT_FALSE(small.estimate_stereo_transform(m.view(), kBaseline, {}, random).found);
  m.left_x[3] = std::numeric_limits<double>::quiet_NaN();
  m.sigma[4] = 0;
  m.right_y[5] = std::numeric_limits<double>::infinity();
  const StereoEstimate found = mlesac_.estimate_stereo_transform(m.view(), kBaseline, {}, random);
  ASSERT_TRUE(found.found);
  EXPECT_EQ(found.inliers, 47);
  EXPECT_EQ(mlesac_.flags()[3] + mlesac_.flags()[4] + mlesac_.flags()[5], 0);
  // All matches are the same.
  for (auto* v : {&m.left_x, &m.left_y, &m.right_x, &m.right_y})
    std::fill(v->begin(), v->end(), 0.1);
  EXPECT_FALSE(mlesac_.estimate_stereo_transform(m.view(), kBaseline, {}, random).found);
}

}  // namespace
}  // namespace vergence
