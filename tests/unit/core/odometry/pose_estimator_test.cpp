#include "core/odometry/pose_estimator.hpp"

#include <algorithm>

#include "tests/unit/core/geometry/rig_scene.hpp"

namespace vergence::odometry {
namespace {

constexpr int kPoints = 300;
// Pixels are floats: 3e-5 px near 640 px, 6e-8 rad of a direction, and 2.4e-6 m at 40 m. Both are
// four times that for a single point; of three hundred the pose is better.
constexpr double kExactTurn = 2.4e-7, kExactShift = 1e-5;

/// Three hundred points at 3 to 40 m before a rig of 640×480 cameras, seen without error by all of
/// them.
struct Scene {
  OdometryOptions options;
  RigCalibration rig;
  Arena arena;
  Map map;
  Random random{17};
  Transform T_left_world{exp_so3({0.3, -0.2, 0.1}), {1, -2, 3}};
  // The true transforms, which may differ from the rig's.
  std::array<Transform, kMaxCameras> T_camera_left{};

  explicit Scene(int cameras = 2) : rig(vergence::test::make_rig(cameras)), map(10, arena) {
    T_camera_left = rig.T_camera_left;
    for (int i = 0; i < kPoints; ++i) {
      MapPoint* p = map.make_point();
      p->stage = i % 2 == 0 ? PointStage::active : PointStage::dormant;
      const double z = random.uniform(3, 40);
      p->p_world = T_left_world.inverse() *
                   Vec3(random.uniform(-0.5, 0.5) * z, random.uniform(-0.4, 0.4) * z, z);
    }
    see();
  }
  void see() {
    for (MapPoint& p : points()) {
      p.now = {};
      for (int k = 0; k < rig.cameras; ++k) {
        const Intrinsics& c = rig.intrinsics[static_cast<std::size_t>(k)];
        const Vec3 q = T_camera_left[static_cast<std::size_t>(k)] * (T_left_world * p.p_world);
        p.now.set(k, {c.fx * q.x() / q.z() + c.cx, c.fy * q.y() / q.z() + c.cy}, 0.15F);
      }
    }
  }
  [[nodiscard]] std::span<MapPoint> points() { return map.points().first(kPoints); }
  void spoil(MapPoint* p, int k) {
    const double angle = random.uniform(0, 6.28);
    p->now.pixel[static_cast<std::size_t>(k)] +=
        (30.0 * Vec2(std::cos(angle), std::sin(angle))).cast<float>();
  }
  [[nodiscard]] Transform near(double rad, double m) const {
    return perturbed(T_left_world, rad * Vec3(1, -1, 1), m * Vec3(1, 1, -1));
  }
  [[nodiscard]] int agreeing(const PoseEstimator& e, int k) const {
    int n = 0;
    for (int i = 0; i < kPoints; ++i) n += (e.agrees()[static_cast<std::size_t>(i)] >> k) & 1;
    return n;
  }
};

void expect_exact(const Transform& found, const Transform& truth) {
  EXPECT_LT(log_so3(found.R * truth.R.transpose()).norm(), kExactTurn);
  EXPECT_LT((found.t - truth.t).norm(), kExactShift);
}

TEST(PoseEstimator, exactObservationsGiveTheExactPose) {
  for (const bool sample : {false, true}) {
    Scene s;
    PoseEstimator e(s.options, s.rig, s.arena);
    const PoseFit fit = e.fit_linked(s.map, s.near(0.01, 0.1), sample);
    ASSERT_TRUE(fit.found);
    expect_exact(fit.T_left_world, s.T_left_world);
    EXPECT_EQ(fit.inliers, kPoints);
    EXPECT_EQ(fit.stereo, kPoints);
    EXPECT_EQ(fit.stereo_found, kPoints);
    EXPECT_EQ(fit.given, kPoints);
    EXPECT_EQ(fit.cameras, 0b11);
    EXPECT_EQ(s.agreeing(e, 0), kPoints);
    EXPECT_EQ(s.agreeing(e, 1), kPoints);
  }
}

TEST(PoseEstimator, candidateAndFreePointsAreNotUsed) {
  Scene s;
  PoseEstimator e(s.options, s.rig, s.arena);
  for (int i = 0; i < 100; ++i) {
    MapPoint& p = s.points()[static_cast<std::size_t>(3 * i)];
    p.stage = i % 2 == 0 ? PointStage::candidate : PointStage::free;
    s.spoil(&p, 0);
  }
  const PoseFit fit = e.fit_linked(s.map, s.T_left_world, true);
  ASSERT_TRUE(fit.found);
  EXPECT_EQ(fit.given, kPoints - 100);
  EXPECT_EQ(fit.inliers, kPoints - 100);
  for (int i = 0; i < 100; ++i) EXPECT_EQ(e.agrees()[static_cast<std::size_t>(3 * i)], 0);
}

TEST(PoseEstimator, outliersInAThirdDoNotMoveThePose) {
  Scene s;
  PoseEstimator e(s.options, s.rig, s.arena);
  for (int i = 0; i < 100; ++i)
    for (int k = 0; k < 2; ++k) s.spoil(&s.points()[static_cast<std::size_t>(3 * i)], k);
  const PoseFit fit = e.fit_linked(s.map, s.near(0.01, 0.1), true);
  ASSERT_TRUE(fit.found);
  expect_exact(fit.T_left_world, s.T_left_world);
  EXPECT_EQ(fit.given, kPoints);
  // A wrong observation may lie right by chance within a pixel or so, not thirty off in both.
  EXPECT_EQ(fit.inliers, kPoints - 100);
}

TEST(PoseEstimator, grossObservationsAreDropped) {
  Scene s;
  PoseEstimator e(s.options, s.rig, s.arena);
  for (int i = 0; i < 5; ++i)
    for (std::size_t k = 0; k < 2; ++k)
      s.points()[static_cast<std::size_t>(60 * i)].now.pixel[k].x() += 10;
  expect_exact(e.fit_linked(s.map, s.near(0.01, 0.1), false).T_left_world, s.T_left_world);
}

TEST(PoseEstimator, contradictingCamerasPreferTheLeft) {
  for (const int seen_left : {kPoints, OdometryOptions{}.ok_inliers - 1}) {
    Scene s;
    s.T_camera_left[1].R = exp_so3({0.03, 0, 0}) * s.T_camera_left[1].R;
    s.see();
    for (int i = seen_left; i < kPoints; ++i) s.points()[static_cast<std::size_t>(i)].now.drop(0);
    PoseEstimator e(s.options, s.rig, s.arena);
    // The right camera sees three hundred points: where the left one sees few it is what holds.
    const PoseFit all = e.fit_linked(s.map, s.near(0.01, 0.1), true);
    ASSERT_TRUE(all.found) << seen_left;
    const std::vector<std::uint8_t> agreed(e.agrees().begin(), e.agrees().end());
    const PoseFit fit = e.prefer_left(s.map, s.near(0.01, 0.1), all);
    ASSERT_TRUE(fit.found) << seen_left;
    if (seen_left == kPoints) {
      expect_exact(fit.T_left_world, s.T_left_world);
      EXPECT_EQ(s.agreeing(e, 0), kPoints);
      EXPECT_EQ(s.agreeing(e, 1), 0);
    } else {
      EXPECT_EQ(fit.T_left_world.t, all.T_left_world.t);
      EXPECT_EQ(s.agreeing(e, 0), 0);
      EXPECT_EQ(s.agreeing(e, 1), kPoints);
      EXPECT_TRUE(std::equal(agreed.begin(), agreed.end(), e.agrees().begin()));
    }
  }
}

TEST(PoseEstimator, independentCameraPosesGiveTheRig) {
  for (const int cameras : {2, 3}) {
    Scene s(cameras);
    std::array<Transform, kMaxCameras> T = s.rig.T_camera_left;
    // The truth is elsewhere than the rig says, a degree and centimetres.
    for (std::size_t k = 1; k < static_cast<std::size_t>(cameras); ++k)
      s.T_camera_left[k] = perturbed(s.T_camera_left[k], {0.02, -0.01, 0.015}, {0.03, -0.02, 0.04});
    s.see();
    PoseEstimator e(s.options, s.rig, s.arena);
    const PoseFit fit = e.fit_unlinked(s.map, s.near(0.01, 0.1), true,
                                       std::span(T).first(static_cast<std::size_t>(cameras)));
    ASSERT_TRUE(fit.found);
    expect_exact(fit.T_left_world, s.T_left_world);
    for (std::size_t k = 1; k < static_cast<std::size_t>(cameras); ++k)
      expect_exact(T[k], s.T_camera_left[k]);
    EXPECT_EQ(fit.cameras, (1 << cameras) - 1);
    EXPECT_EQ(fit.stereo, kPoints);
    EXPECT_EQ(T[0].t.norm(), 0) << "the left camera is the rig's origin";
  }
}

TEST(PoseEstimator, cameraWithFewPointsKeepsItsPrediction) {
  Scene s;
  std::array<Transform, kMaxCameras> T = s.rig.T_camera_left;
  T[1] = perturbed(T[1], {0.001, 0, 0}, Vec3::Zero());
  const Transform predicted = T[1];
  for (std::size_t i = 8; i < kPoints; ++i) s.points()[i].now.drop(1);
  PoseEstimator e(s.options, s.rig, s.arena);
  const PoseFit fit = e.fit_unlinked(s.map, s.near(0.01, 0.1), true, std::span(T).first(2));
  ASSERT_TRUE(fit.found) << "the left camera's points hold it";
  expect_exact(fit.T_left_world, s.T_left_world);
  EXPECT_EQ(T[1].R, predicted.R);
  EXPECT_EQ(T[1].t, predicted.t);
  EXPECT_EQ(fit.cameras, 0b01);
  EXPECT_EQ(s.agreeing(e, 1), 0);
}

TEST(PoseEstimator, missingLeftImageGivesNoPose) {
  Scene s;
  std::array<Transform, kMaxCameras> T = s.rig.T_camera_left;
  for (MapPoint& p : s.points()) p.now.drop(0);
  PoseEstimator e(s.options, s.rig, s.arena);
  EXPECT_FALSE(e.fit_unlinked(s.map, s.T_left_world, true, std::span(T).first(2)).found);
  EXPECT_FALSE(e.fit_left(s.map, s.T_left_world).found);
}

TEST(PoseEstimator, tooFewPointsGiveNoPose) {
  Scene s;
  PoseEstimator e(s.options, s.rig, s.arena);
  const auto keep = [&](int n) {
    s.see();
    for (int i = n; i < kPoints; ++i) s.points()[static_cast<std::size_t>(i)].now = {};
  };
  keep(s.options.min_inliers - 1);
  EXPECT_FALSE(e.fit_linked(s.map, s.T_left_world, true).found);
  keep(s.options.min_inliers);
  EXPECT_TRUE(e.fit_linked(s.map, s.T_left_world, true).found);
  // One camera alone needs as many as make a pose good.
  keep(s.options.ok_inliers - 1);
  for (MapPoint& p : s.points()) p.now.drop(1);
  EXPECT_FALSE(e.fit_linked(s.map, s.T_left_world, true).found);
  keep(0);
  const PoseFit nothing = e.fit_linked(s.map, s.T_left_world, true);
  EXPECT_FALSE(nothing.found);
  EXPECT_EQ(nothing.inliers, 0);
}

TEST(PoseEstimator, singleCameraPoseNeedsAShareOfItsPoints) {
  Scene s;
  PoseEstimator e(s.options, s.rig, s.arena);
  Transform T;
  ASSERT_TRUE(e.fit_camera(s.map, 1, s.T_camera_left[1] * s.near(0.01, 0.1), &T));
  expect_exact(T, s.T_camera_left[1] * s.T_left_world);
  // Matches by chance: every observation somewhere.
  for (MapPoint& p : s.points())
    p.now.set(1, {s.random.uniform(0, 639), s.random.uniform(0, 479)}, 0.15F);
  EXPECT_FALSE(e.fit_camera(s.map, 1, s.T_camera_left[1] * s.T_left_world, &T));
}

}  // namespace
}  // namespace vergence::odometry
