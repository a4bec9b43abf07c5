#include "core/calibration/disparity_jump.hpp"

#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "core/math/random.hpp"
#include "core/math/so3.hpp"

namespace vergence::calibration {
namespace {

// The baseline is KITTI's, in m.
constexpr double kBaseline = 0.54;
constexpr Pinhole kPinhole{718, 718, 607, 185};
// Noise of a coordinate, in px.
constexpr double kNoise = 0.2;
constexpr std::size_t kTracks = 150;

Transform rig(double yaw_deg) {
  return {exp_so3(Vec3(0, yaw_deg * std::numbers::pi / 180, 0)), Vec3(-kBaseline, 0, 0)};
}

/// A street that is driven along; each track is seen in some ten frames. The rig that took the
/// images may be another than the one that the detector is told.
class Street {
 public:
  explicit Street(const Transform& believed, std::uint64_t seed = 1)
      : detector_(2 * kTracks, arena_), random_(seed) {
    detector_.set_reference({believed, kPinhole, kPinhole});
    for (std::size_t i = 0; i < kTracks; ++i) points_.push_back(fresh());
  }

  DisparityJump drive(const Transform& T_right_left, double noise = kNoise) {
    std::vector<StereoObservation> seen;
    move();
    for (const Point& p : points_) {
      const Vec3 r = T_right_left * p.at;
      StereoObservation s{.left = pixel(p.at, noise),
                          .right = pixel(r, noise),
                          .sigma_px = kNoise,
                          .track = p.track};
      seen.push_back(s);
    }
    return detector_.next(frame_++, seen, step_);
  }
  /// Without an image of the right camera.
  void drive_unseen() {
    move();
    detector_.skip(step_);
    ++frame_;
  }

 private:
  struct Point {
    Vec3 at;
    std::uint32_t track;
  };
  void move() {
    for (Point& p : points_) {
      p.at = step_ * p.at;
      if (p.at.z() < 4) p = fresh();
    }
  }
  Point fresh() {
    return {Vec3(random_.uniform(-12, 12), random_.uniform(-3, 2), random_.uniform(6, 40)),
            next_track_++};
  }
  Vec2 pixel(const Vec3& p, double noise) {
    return {kPinhole.fx * p.x() / p.z() + kPinhole.cx + noise * random_.normal(),
            kPinhole.fy * p.y() / p.z() + kPinhole.cy + noise * random_.normal()};
  }

  const Transform step_{exp_so3(Vec3(0.002, 0.01, 0.001)), Vec3(0.02, 0.01, -0.9)};
  Arena arena_;
  DisparityJumpDetector detector_;
  Random random_;
  std::vector<Point> points_;
  std::uint32_t next_track_ = 1;
  std::uint64_t frame_ = 0;
};

TEST(DisparityJump, yawKnockIsConfirmedInTheNextFrame) {
  for (const double yaw : {0.1, -0.1, 0.3, 1.0}) {
    Street street(rig(0));
    for (int i = 0; i < 20; ++i) EXPECT_FALSE(street.drive(rig(0)).suspected) << yaw << ", " << i;
    const DisparityJump jump = street.drive(rig(yaw));
    EXPECT_TRUE(jump.suspected) << yaw;
    // A turn by α moves the image by f tan α at its centre, and by up to 1 + (x/f)² of that at the
    // sides: less than twice as much.
    const double centre = kPinhole.fx * std::abs(yaw) * std::numbers::pi / 180;
    EXPECT_GT(std::abs(jump.px), centre - 5 * jump.sigma_px);
    EXPECT_LT(std::abs(jump.px), 2 * centre);
    const DisparityJump next = street.drive(rig(yaw));
    EXPECT_TRUE(next.confirmed) << yaw;
    EXPECT_EQ(next.onset_frame, 20U);
  }
}

TEST(DisparityJump, noiseOrConstantWrongYawIsNoJump) {
  for (const double yaw : {0.0, 0.3, -1.0})
    for (std::uint64_t seed = 1; seed <= 5; ++seed) {
      Street street(rig(yaw), seed);
      for (int i = 0; i < 300; ++i)
        EXPECT_FALSE(street.drive(rig(0)).suspected) << yaw << ", " << seed << ", " << i;
    }
}

TEST(DisparityJump, singleWrongImageIsNotConfirmed) {
  Street street(rig(0));
  for (int i = 0; i < 20; ++i) (void)street.drive(rig(0));
  EXPECT_TRUE(street.drive(rig(0.3)).suspected);
  const DisparityJump back = street.drive(rig(0));
  EXPECT_FALSE(back.suspected);
  EXPECT_FALSE(back.confirmed);
  EXPECT_FALSE(street.drive(rig(0)).confirmed);
}

TEST(DisparityJump, missingImageNeitherConfirmsNorHidesAJump) {
  Street spoilt(rig(0));
  for (int i = 0; i < 20; ++i) (void)spoilt.drive(rig(0));
  EXPECT_TRUE(spoilt.drive(rig(0.3)).suspected);
  spoilt.drive_unseen();
  for (int i = 0; i < 3; ++i) EXPECT_FALSE(spoilt.drive(rig(0)).confirmed) << i;

  Street turned(rig(0));
  for (int i = 0; i < 20; ++i) (void)turned.drive(rig(0));
  EXPECT_TRUE(turned.drive(rig(0.3)).suspected);
  turned.drive_unseen();
  const DisparityJump jump = turned.drive(rig(0.3));
  EXPECT_TRUE(jump.confirmed);
  EXPECT_EQ(jump.onset_frame, 20U);
}

TEST(DisparityJump, knockDuringMissingImagesIsConfirmed) {
  Street street(rig(0));
  for (int i = 0; i < 20; ++i) (void)street.drive(rig(0));
  for (int i = 0; i < 2; ++i) street.drive_unseen();
  EXPECT_TRUE(street.drive(rig(0.3)).suspected);
  EXPECT_TRUE(street.drive(rig(0.3)).confirmed);
}

// 0.03° are 0.38 px: shaken by that, 1 px is within five times the scatter (1.9 px), and eight calm
// frames later still, for (19/20)^8 of its square are left (1.5 px).
TEST(DisparityJump, vibrationRaisesTheThresholdForTwentyFrames) {
  Street street(rig(0));
  for (int i = 0; i < 40; ++i) EXPECT_FALSE(street.drive(rig(i % 2 == 0 ? 0 : 0.03)).suspected);
  for (int i = 0; i < 8; ++i) EXPECT_FALSE(street.drive(rig(0)).suspected);
  EXPECT_FALSE(street.drive(rig(0.08)).suspected);
  for (int i = 0; i < 60; ++i) (void)street.drive(rig(0.08));
  EXPECT_TRUE(street.drive(rig(0)).suspected) << "calm for long, it is a jump";
}

TEST(DisparityJump, tooFewTracksMeasureNothing) {
  Arena arena;
  DisparityJumpDetector detector(10, arena);
  detector.set_reference({rig(0), kPinhole, kPinhole});
  const std::vector<StereoObservation> same(
      40, StereoObservation{Vec2(600, 180), Vec2(580, 180), 0.2, 1});
  for (std::uint64_t i = 0; i < 4; ++i)
    EXPECT_FALSE(detector.next(i, same, Transform{}).measured) << i;
}

}  // namespace
}  // namespace vergence::calibration
