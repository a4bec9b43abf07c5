#include "drivers/mock/world/drive.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "drivers/mock/world/detail/scene.hpp"

namespace vergence::mock {
namespace {

/// The drive needs the ground only.
const World& bare_world() {
  static const World world(WorldOptions{}, std::make_unique<Scene>());
  return world;
}

Drive make(DriveKind kind) { return Drive({.kind = kind}, bare_world()); }

TEST(Drive, derivativesMatchCentralDifferences) {
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
    // The fifth derivative of the spline jumps.
    EXPECT_LT(((b.velocity - a.velocity) / dt - s.acceleration).norm(), 1e-3) << seconds;
    EXPECT_LT((log_so3(a.T_enu_body.R.transpose() * b.T_enu_body.R) / dt - s.angular_rate).norm(),
              2e-6)
        << seconds;
  }
}

TEST(Drive, speedAndAccelerationStayWithinLimits) {
  DriveOptions options{.suspension = 0, .vibration = 0};
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
  // The driver's wandering adds its square.
  EXPECT_LT(speed, 1.02 * options.speed);
  EXPECT_LT(acceleration, 1.3 * options.acceleration + 0.2);
  EXPECT_LT(turn, options.lateral + 0.4);
  EXPECT_NEAR(steepest * 180 / std::numbers::pi, WorldOptions{}.hill_deg, 0.1);
}

TEST(Drive, vehicleFollowsGroundAndHeading) {
  const Drive drive({.suspension = 0, .vibration = 0}, bare_world());
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

}  // namespace
}  // namespace vergence::mock
