#include "drivers/mock/world/drive.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <stdexcept>

#include "drivers/mock/world/detail/scene.hpp"

namespace vergence::mock {
namespace {

/// The drive needs the ground only.
const World& bare_world() {
  static const World world(WorldOptions{}, std::make_unique<Scene>());
  return world;
}

Drive make(DriveKind kind) {
  DriveOptions options;
  options.kind = kind;
  return Drive(options, bare_world());
}

TEST(Drive, loopIsOneKilometreAndReturnsNearItsStart) {
  const Drive drive = make(DriveKind::loop);
  double path = 0;
  Vec3 last = drive.at({}).T_enu_body.t;
  for (Duration t{}; t <= drive.duration(); t = t + Duration::milliseconds(50)) {
    const Vec3 p = drive.at(t).T_enu_body.t;
    path += (p - last).norm();
    last = p;
  }
  EXPECT_NEAR(path, 1000.0, 15.0);
  EXPECT_NEAR(path, drive.length(),
              5.0);  // the nominal way is level, without the driver's wandering
  EXPECT_LT((last - drive.at({}).T_enu_body.t).norm(), 10.0);
}

TEST(Drive, beginsAndEndsStanding) {
  for (const DriveKind kind : {DriveKind::loop, DriveKind::figure_eight, DriveKind::straight,
                               DriveKind::brief, DriveKind::still}) {
    const Drive drive = make(kind);
    for (const Duration t : {Duration::seconds(-5), Duration{}, Duration::seconds(1),
                             drive.duration(), drive.duration() + Duration::seconds(9)}) {
      const BodyState s = drive.at(t);
      EXPECT_LT(s.velocity.norm(), 1e-6) << static_cast<int>(kind) << " at " << t.to_seconds();
      EXPECT_LT(s.angular_rate.norm(), 1e-6) << static_cast<int>(kind) << " at " << t.to_seconds();
    }
  }
}

TEST(Drive, derivativesAreThoseOfTheFunction) {
  // Central differences over ±h miss a derivative by h²/6 of the one two orders higher: a 12 Hz
  // shake of 0.02° or 0.6 mm has a third derivative of 150 rad/s³ and 260 m/s³, with h = 0.1 ms
  // below 1e-6. Rounding: 1e-16 · 300 m / h = 3e-10.
  const Drive drive = make(DriveKind::figure_eight);
  const Duration h = Duration::microseconds(100);
  for (double seconds = 0.0137; seconds < drive.duration().to_seconds(); seconds += 0.7731) {
    const Duration t = Duration::seconds(seconds);
    const BodyState s = drive.at(t), a = drive.at(t - h), b = drive.at(t + h);
    const double dt = 2 * h.to_seconds();
    EXPECT_LT(((b.T_enu_body.t - a.T_enu_body.t) / dt - s.velocity).norm(), 2e-6) << seconds;
    EXPECT_LT(((b.velocity - a.velocity) / dt - s.acceleration).norm(), 1e-3)
        << seconds;  // fifth derivative of the spline: jumps
    EXPECT_LT((log_so3(a.T_enu_body.R.transpose() * b.T_enu_body.R) / dt - s.angular_rate).norm(),
              2e-6)
        << seconds;
  }
}

TEST(Drive, staysWithinTheDriversLimits) {
  DriveOptions options;
  options.vibration = 0;
  options.suspension = 0;
  const Drive drive(options, bare_world());
  double speed = 0, acceleration = 0, turn = 0, steepest = 0;
  for (Duration t{}; t < drive.duration(); t = t + Duration::milliseconds(20)) {
    const BodyState s = drive.at(t);
    const Vec3 forward = s.T_enu_body.R.col(0);
    speed = std::max(speed, s.velocity.norm());
    acceleration = std::max(acceleration, std::abs(s.acceleration.dot(forward)));
    turn = std::max(turn, std::abs(s.acceleration.dot(s.T_enu_body.R.col(1))));
    steepest = std::max(steepest, std::asin(std::abs(forward.z())));
    EXPECT_NEAR((s.T_enu_body.R.transpose() * s.T_enu_body.R - Mat3::Identity()).norm(), 0, 1e-12);
  }
  EXPECT_GT(speed, 0.97 * options.speed);
  EXPECT_LT(speed, 1.02 * options.speed);  // the driver's wandering adds its square
  EXPECT_LT(acceleration, 1.3 * options.acceleration + 0.2);
  EXPECT_LT(turn, options.lateral + 0.4);
  EXPECT_NEAR(steepest * 180 / std::numbers::pi, WorldOptions{}.hill_deg, 0.1);
}

TEST(Drive, vehicleStandsOnTheGroundAndLooksWhereItGoes) {
  DriveOptions options;
  options.suspension = 0;
  options.vibration = 0;
  const Drive drive(options, bare_world());
  for (Duration t = Duration::seconds(5); t < drive.duration();
       t = t + Duration::milliseconds(310)) {
    const BodyState s = drive.at(t);
    EXPECT_NEAR(s.T_enu_body.t.z(), bare_world().ground(s.T_enu_body.t.x(), s.T_enu_body.t.y()),
                0.01);
    if (s.velocity.norm() > 3.0) {
      EXPECT_GT(s.velocity.normalized().dot(s.T_enu_body.R.col(0)), std::cos(0.05))
          << t.to_seconds();
    }
  }
}

TEST(Drive, loopStopsTwiceOnItsWay) {
  const Drive drive = make(DriveKind::loop);
  int starts = 0;
  bool moving = false;
  for (Duration t{}; t < drive.duration(); t = t + Duration::milliseconds(50)) {
    const double v = drive.at(t).velocity.norm();
    if (!moving && v > 1.0) {
      ++starts;
      moving = true;
    }
    if (v < 0.01) moving = false;
  }
  EXPECT_EQ(starts, 3);  // at the beginning and after each stop
}

TEST(Drive, sameSeedSameWayOtherSeedOtherUnrest) {
  DriveOptions options;
  const Drive a(options, bare_world()), b(options, bare_world());
  options.seed = 2;
  const Drive c(options, bare_world());
  const Duration t = Duration::seconds(21.3);
  EXPECT_EQ(a.at(t).T_enu_body.t, b.at(t).T_enu_body.t);
  EXPECT_NE(a.at(t).T_enu_body.R, c.at(t).T_enu_body.R);
}

TEST(Drive, refusesImpossibleOptionsByName) {
  DriveOptions options;
  options.speed = 0;
  try {
    const Drive drive(options, bare_world());
    FAIL() << "a speed of zero was accepted";
  } catch (const std::invalid_argument& e) {
    EXPECT_NE(std::string(e.what()).find("speed"), std::string::npos);
  }
}

TEST(CameraMount, looksForwardAndDownByTheTilt) {
  const Transform T_body_camera = camera_mount({1, 2, 3}, 0.1);
  EXPECT_LT((T_body_camera * Vec3(0, 0, 1) - Vec3(1 + std::cos(0.1), 2, 3 - std::sin(0.1))).norm(),
            1e-12);
  EXPECT_LT((T_body_camera * Vec3(1, 0, 0) - Vec3(1, 1, 3)).norm(),
            1e-12);  // its right is the body's right
  EXPECT_NEAR(T_body_camera.R.determinant(), 1.0, 1e-12);
}

}  // namespace
}  // namespace vergence::mock
