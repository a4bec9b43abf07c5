#include "core/comparison/attitude_check.hpp"

#include <numbers>

#include <gtest/gtest.h>

namespace vergence {
namespace {

constexpr double kEast = 0, kNorth = std::numbers::pi / 2;

/// Drives `metres` to the east, one fix a metre, with the attitude's yaw, rad.
void drive_east(AttitudeCheck* check, double from, double metres, double yaw) {
  for (double x = from; x <= from + metres; x += 1) check->add({x, 0}, 0.1, yaw);
}

TEST(AttitudeCheck, wrongYawIsContradictedAfterFiftyMetres) {
  AttitudeCheck check;
  drive_east(&check, 0, 45, kNorth);
  EXPECT_FALSE(check.contradicted());
  drive_east(&check, 46, 10, kNorth);
  EXPECT_TRUE(check.contradicted());
  EXPECT_TRUE(check.mostly_off());
  drive_east(&check, 57, 40, kEast);
  EXPECT_TRUE(check.contradicted());
  drive_east(&check, 98, 15, kEast);
  EXPECT_FALSE(check.contradicted());
}

TEST(AttitudeCheck, jumpOrTwentyDegreesIsNoContradiction) {
  AttitudeCheck check;
  check.add({0, 0}, 0.1, kNorth);
  check.add({1000, 0}, 0.1, kNorth);
  EXPECT_FALSE(check.contradicted());
  AttitudeCheck skewed;
  drive_east(&skewed, 0, 200, 20 * std::numbers::pi / 180);
  EXPECT_FALSE(skewed.contradicted());
  ASSERT_TRUE(skewed.course());
  EXPECT_NEAR(*skewed.course(), kEast, 1e-12);
}

}  // namespace
}  // namespace vergence
