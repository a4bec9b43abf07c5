#include "core/odometry/window.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "core/math/random.hpp"
#include "core/math/so3.hpp"
#include "core/odometry/undistorted_camera.hpp"
#include "tests/support/parallel_rig.hpp"

namespace vergence::odometry {
namespace {

RigCalibration rig() {
  RigCalibration r = vergence::test::parallel_rig(vergence::test::pinhole(640, 480, 500), 0.5);
  r.T_camera_left[1] = {exp_so3(Vec3(0.01, -0.02, 0.015)), Vec3(-0.5, 0.01, 0.02)};
  return r;
}

OdometryOptions many_steps() {
  OdometryOptions o{.window_keyframes = 6, .window_steps = 30};
  return o;
}

/// Six keyframes along a bend before a cloud of points, each seen wherever it falls into an image;
/// exact but for the rounding to floats, 3e-5 px.
struct Bend {
  RigCalibration calibration = rig();
  OdometryOptions options = many_steps();
  Arena arena;
  Map map{6, arena};
  SequentialRunner runner;
  WindowAdjuster adjuster{options, calibration, arena, runner};
  std::vector<Transform> poses;
  std::vector<Vec3> points;

  Bend() {
    Random random(17);
    for (int i = 0; i < 120; ++i) {
      const double z = random.uniform(5, 25);
      points.emplace_back(random.uniform(-0.45, 0.45) * z, random.uniform(-0.4, 0.4) * z, z);
      MapPoint* p = map.make_point();
      p->stage = i % 4 == 0 ? PointStage::dormant : PointStage::active;
      p->p_world = points.back();
    }
    for (int i = 0; i < 6; ++i) {
      poses.push_back(Transform{exp_so3(Vec3(0.002 * i, 0.02 * i, -0.003 * i)),
                                Vec3(0.03 * i, 0.01 * i, -0.4 * i)});
      const std::size_t slot = map.make_keyframe({poses.back(), {}, Stamp(i)});
      for (MapPoint& p : map.points())
        if (p.stage != PointStage::free) see(&p, slot, poses.back());
    }
  }
  void see(MapPoint* p, std::size_t slot, const Transform& T_left_world) const {
    for (int k = 0; k < 2; ++k) {
      const auto i = static_cast<std::size_t>(k);
      const Camera camera = UndistortedCamera(calibration.intrinsics[i]).ideal();
      Vec2 pixel;
      if (camera.project(calibration.T_camera_left[i] * (T_left_world * p->p_world), &pixel,
                         nullptr) == ProjectStatus::ok &&
          camera.inside(pixel, 0))
        p->seen[slot].set(k, pixel, 0.15F);
    }
  }
  /// All poses but the first, and all points, from where they are not.
  void disturb() {
    Random random(23);
    const auto some = [&](double size) {
      return Vec3(size * random.normal(), size * random.normal(), size * random.normal());
    };
    for (std::size_t i = 1; i < poses.size(); ++i)
      map.keyframe(map.order()[i]).T_left_world = perturbed(poses[i], some(0.003), some(0.03));
    for (MapPoint& p : map.points())
      if (p.stage != PointStage::free) p.p_world += some(0.005 * p.p_world.z());
  }
  [[nodiscard]] double worst_pose_error() const {
    double worst = 0;
    for (std::size_t i = 0; i < poses.size(); ++i) {
      const Transform& T = map.keyframe(map.order()[i]).T_left_world;
      worst = std::max(
          {worst, (T.t - poses[i].t).norm(), log_so3(T.R * poses[i].R.transpose()).norm()});
    }
    return worst;
  }
  [[nodiscard]] int observations() const {
    int n = 0;
    for (const MapPoint& p : map.points())
      for (const std::uint8_t slot : map.order())
        n += p.stage == PointStage::free
                 ? 0
                 : (p.seen[slot].by(0) ? 1 : 0) + (p.seen[slot].by(1) ? 1 : 0);
    return n;
  }
};

TEST(WindowAdjuster, exactObservationsRestoreThePoses) {
  Bend b;
  const Transform first = b.map.keyframe(b.map.order()[0]).T_left_world;
  b.disturb();
  ASSERT_GT(b.worst_pose_error(), 0.02);
  const int before = b.observations();
  const WindowOutcome out = b.adjuster.adjust(b.map, true);
  EXPECT_LT(b.worst_pose_error(), 1e-6);
  EXPECT_EQ(out.dropped, 0);
  EXPECT_EQ(b.observations(), before);
  EXPECT_EQ(b.map.keyframe(b.map.order()[0]).T_left_world.t, first.t)
      << "the oldest keyframe holds the window";
}

TEST(WindowAdjuster, onlyGrossOutliersAreDropped) {
  Bend b;
  b.disturb();
  int wrong = 0;
  for (std::size_t i = 3; i < 120; i += 11) {
    MapPoint& p = b.map.points()[i];
    const std::size_t slot = b.map.order()[2 + i % 3];
    if (!p.seen[slot].by(1)) continue;
    p.seen[slot].pixel[1] += Eigen::Vector2f(20, -14);
    ++wrong;
  }
  ASSERT_GE(wrong, 8);
  const int before = b.observations();
  const WindowOutcome out = b.adjuster.adjust(b.map, true);
  EXPECT_EQ(out.dropped, wrong);
  EXPECT_EQ(b.observations(), before - wrong);
  (void)b.adjuster.adjust(b.map, true);
  EXPECT_LT(b.worst_pose_error(), 1e-6) << "once they are gone they leave nothing behind";
}

TEST(WindowAdjuster, candidatesMoveNothing) {
  Bend b;
  MapPoint* lie = b.map.make_point();
  lie->stage = PointStage::candidate;
  lie->p_world = Vec3(0, 0, 10);
  for (const std::uint8_t slot : b.map.order()) lie->seen[slot].set(0, {10.0 * slot, 400}, 0.01F);
  (void)b.adjuster.adjust(b.map, true);
  EXPECT_LT(b.worst_pose_error(), 1e-6);
  EXPECT_EQ(lie->p_world, Vec3(0, 0, 10));
}

TEST(WindowAdjuster, singleKeyframeOrNoPointsChangesNothing) {
  Bend b;
  b.map.clear();
  EXPECT_EQ(b.adjuster.adjust(b.map, true).observations, 0);
  (void)b.map.make_keyframe({b.poses[1], {}, Stamp(1)});
  (void)b.adjuster.adjust(b.map, true);
  EXPECT_EQ(b.map.keyframe(b.map.order()[0]).T_left_world.t, b.poses[1].t);
}

TEST(WindowAdjuster, unlinkedImageWithoutPointsKeepsItsTransform) {
  Bend b;
  for (MapPoint& p : b.map.points())
    for (const std::uint8_t slot : b.map.order()) p.seen[slot].drop(1);
  for (const std::uint8_t slot : b.map.order())
    b.map.keyframe(slot).T_camera_left = b.calibration.T_camera_left;
  b.disturb();
  ASSERT_TRUE(b.adjuster.adjust(b.map, false).usable);
  for (const std::uint8_t slot : b.map.order()) {
    const Transform& T = b.map.keyframe(slot).T_camera_left[1];
    EXPECT_EQ(T.t, b.calibration.T_camera_left[1].t);
    EXPECT_EQ(T.R, b.calibration.T_camera_left[1].R);
  }
}

/// The turn about the camera's y by which the adjuster's rig differs from the one that the
/// observations were made with.
double turn_left(const Bend& b) {
  return log_so3(Mat3(b.adjuster.T_camera_left()[1].R * rig().T_camera_left[1].R.transpose()))
      .norm();
}

constexpr double kTurned = 2e-3;  // rad: a disparity of 1 px

TEST(WindowAdjuster, extrinsicRotationErrorIsEstimated) {
  Bend b;
  b.options.extrinsic_rotation_sigma_rad = 0.05;
  const Vec3 axis = Vec3::UnitZ().cross(b.calibration.T_camera_left[1].t).normalized();
  b.calibration.T_camera_left[1].R = exp_so3(kTurned * axis) * b.calibration.T_camera_left[1].R;
  b.adjuster.adopt_rig();
  ASSERT_NEAR(turn_left(b), kTurned, 1e-9);
  b.disturb();
  ASSERT_TRUE(b.adjuster.adjust(b.map, true).usable);
  // The prior weighs a hundredth of the (0.2 mrad / 50 mrad)² that a window of exact observations
  // at 0.15 px would leave it.
  EXPECT_LT(turn_left(b), 0.01 * kTurned);
  EXPECT_LT(b.worst_pose_error(), 0.01 * 2.0) << "of the 2 m driven";
}

TEST(WindowAdjuster, certainCalibrationIsKeptFixed) {
  Bend b;
  const Vec3 axis = Vec3::UnitZ().cross(b.calibration.T_camera_left[1].t).normalized();
  b.calibration.T_camera_left[1].R = exp_so3(kTurned * axis) * b.calibration.T_camera_left[1].R;
  constexpr double kCertain = 1e-7;
  for (int i = 0; i < 6; ++i)
    b.calibration.covariance.set(extrinsic_row(1) + i, extrinsic_row(1) + i, kCertain * kCertain);
  b.adjuster.adopt_rig();
  b.disturb();
  ASSERT_TRUE(b.adjuster.adjust(b.map, true).usable);
  EXPECT_NEAR(turn_left(b), kTurned, 0.01 * kTurned);
  b.options.extrinsic_rotation_sigma_rad = 0;
  b.adjuster.adopt_rig();
  ASSERT_TRUE(b.adjuster.adjust(b.map, true).usable);
  EXPECT_NEAR(turn_left(b), kTurned, 1e-12);
}

}  // namespace
}  // namespace vergence::odometry
