#include "core/odometry/new_points.hpp"

#include <gtest/gtest.h>

namespace vergence::odometry {
namespace {

TEST(NewPoints, areLostWhereFewerThanThreeInTenAreKept) {
  NewPoints points;
  points.add(100, 31);
  EXPECT_FALSE(points.lost());
  points.add(100, 29);
  EXPECT_TRUE(points.lost());
  points.add(100, 90);
  EXPECT_FALSE(points.lost());
  points.add(100, 0);
  points.forget();
  EXPECT_FALSE(points.lost());
}

TEST(NewPoints, fewAtATimeAreJudgedTogether) {
  NewPoints points;
  points.add(40, 0);  // one blurred frame
  ASSERT_TRUE(points.lost());
  points.add(12, 10);
  points.add(12, 10);
  EXPECT_TRUE(points.lost()) << "24 are not enough";
  points.add(12, 10);
  EXPECT_FALSE(points.lost());
  for (int i = 0; i < 3; ++i) points.add(12, 1);
  EXPECT_TRUE(points.lost()) << "few new points, and nearly all of them lost";
}

}  // namespace
}  // namespace vergence::odometry
