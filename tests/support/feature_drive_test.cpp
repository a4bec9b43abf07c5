#include "tests/support/feature_drive.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "core/geometry/epipolar.hpp"

namespace vergence::test {
namespace {

Vec2 ray(const Pinhole& k, const Vec2& p) { return {(p.x() - k.cx) / k.fx, (p.y() - k.cy) / k.fy}; }

FeatureDriveOptions exact() {
  FeatureDriveOptions o;
  o.white_px = o.constant_px = o.walk_px = o.bias_px = o.outliers = o.movers = 0;
  return o;
}

/// Largest distance of a right pixel to the epipolar line of the true transform, px.
double worst(const FeatureDrive& drive) {
  const EpipolarGeometry geometry(drive.T_right_left());
  double most = 0, d = 0;
  for (const FeatureTrack& t : drive.tracks()) {
    EXPECT_EQ(geometry.to_line(ray(drive.options().left, t.left),
                               ray(drive.options().right, t.right), &d, nullptr),
              EpipolarStatus::ok);
    most = std::max(most, std::abs(d) * drive.options().right.fy);
  }
  return most;
}

TEST(FeatureDrive, exactTracksFitTheTrueRigThroughAKnockAndADrift) {
  FeatureDriveOptions o = exact();
  o.changes = {{20, Vec3(0.01, -0.02, 0.005), Vec3(0, 0.003, 0.01), 0},
               {40, Vec3(0.002, 0, 0), Vec3::Zero(), 30}};
  FeatureDrive drive(o);
  for (int i = 0; i < 80; ++i) {
    drive.next();
    EXPECT_LT(worst(drive), 1e-6) << "frame " << i;
    EXPECT_EQ(drive.frame(), static_cast<std::uint64_t>(i));
    for (const FeatureTrack& t : drive.tracks()) {
      const Vec3 p = drive.T_left_world() * t.p_world;
      EXPECT_LT(
          (Vec2(o.left.fx * p.x() / p.z() + o.left.cx, o.left.fy * p.y() / p.z() + o.left.cy) -
           t.left)
              .norm(),
          1e-6);
    }
  }
  EXPECT_NEAR(
      rotation_angle(drive.T_right_left().R *
                     perturbed(o.T_right_left, {0.01, -0.02, 0.005}, Vec3::Zero()).R.transpose()),
      0.002, 1e-9);
}

TEST(FeatureDrive, keepsItsTracksAliveAsLongAsAsked) {
  FeatureDrive drive({});
  std::map<std::uint32_t, int> lives;
  for (int i = 0; i < 200; ++i) {
    drive.next();
    EXPECT_GE(drive.tracks().size(), 295U);
    for (const FeatureTrack& t : drive.tracks()) ++lives[t.id];
  }
  double sum = 0;
  for (const auto& [id, frames] : lives) {
    EXPECT_LE(frames, 20);
    sum += frames;
  }
  EXPECT_GT(sum / static_cast<double>(lives.size()),
            7.0);  // 12.5 but for those that leave the image
}

TEST(FeatureDrive, aLaggingCameraFitsTheRigOnlyWhileStanding) {
  FeatureDriveOptions o = exact();
  o.lags = {{0, 1.0}};
  FeatureDrive moving(o);
  o.speed = 0;
  FeatureDrive standing(o);
  for (int i = 0; i < 30; ++i) moving.next(), standing.next();
  EXPECT_GT(worst(moving), 1.0);
  EXPECT_LT(worst(standing), 1e-6);
}

TEST(FeatureDrive, errorsHaveTheSizeAskedFor) {
  FeatureDriveOptions o;
  o.walk_px = o.outliers = o.movers = 0;
  FeatureDrive drive(o);
  double sum2 = 0;
  std::size_t n = 0;
  for (int i = 0; i < 100; ++i) {
    drive.next();
    for (const FeatureTrack& t : drive.tracks()) {
      const Vec3 p = drive.T_left_world() * t.p_world;
      sum2 += (Vec2(o.left.fx * p.x() / p.z() + o.left.cx, o.left.fy * p.y() / p.z() + o.left.cy) -
               t.left)
                  .squaredNorm();
      n += 2;
    }
  }
  EXPECT_NEAR(std::sqrt(sum2 / static_cast<double>(n)), std::hypot(0.3, 0.3), 0.02);
}

TEST(FeatureDrive, theSameOptionsGiveTheSameDrive) {
  FeatureDriveOptions o;
  o.drive_s = 20, o.stop_s = 5;
  FeatureDrive a(o), b(o);
  bool stood = false;
  for (int i = 0; i < 700; ++i) {
    a.next(), b.next();
    ASSERT_EQ(a.tracks().size(), b.tracks().size());
    for (std::size_t k = 0; k < a.tracks().size(); ++k)
      ASSERT_EQ(a.tracks()[k].right, b.tracks()[k].right);
    stood = stood || (i > 100 && a.speed() == 0);
  }
  EXPECT_TRUE(stood);
}

}  // namespace
}  // namespace vergence::test
