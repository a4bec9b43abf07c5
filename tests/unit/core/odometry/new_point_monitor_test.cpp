#include "core/odometry/new_point_monitor.hpp"

#include <gtest/gtest.h>

namespace vergence::odometry {
namespace {

TEST(NewPointMonitor, fewerThanThreeInTenKeptIsLost) {
  NewPointMonitor watch;
  EXPECT_FALSE(watch.lost());
  watch.add(100, 31);
  EXPECT_FALSE(watch.lost());
  watch.add(100, 29);
  EXPECT_TRUE(watch.lost());
  watch.add(100, 90);
  EXPECT_FALSE(watch.lost());
  watch.add(100, 0);
  watch.reset();
  EXPECT_FALSE(watch.lost());
}

TEST(NewPointMonitor, fewPointsAreEvaluatedTogether) {
  NewPointMonitor watch;
  // One frame is blurred.
  watch.add(40, 0);
  ASSERT_TRUE(watch.lost());
  watch.add(12, 10);
  watch.add(12, 10);
  EXPECT_TRUE(watch.lost()) << "24 are not enough";
  watch.add(12, 10);
  EXPECT_FALSE(watch.lost());
  for (int i = 0; i < 3; ++i) watch.add(12, 1);
  EXPECT_TRUE(watch.lost()) << "few new points, and nearly all of them lost";
}

}  // namespace
}  // namespace vergence::odometry
