#include "core/odometry/moving_scene.hpp"

#include <gtest/gtest.h>

namespace vergence::odometry {
namespace {

/// Whether a frame whose points agree is told, of a scene that was never told before.
bool tells(MovingScene scene) { return scene.judge(false, true); }

TEST(MovingScene, newPointsAreLostWhereFewerThanThreeInTenAreKept) {
  MovingScene scene;
  scene.add(100, 31);
  EXPECT_FALSE(tells(scene));
  scene.add(100, 29);
  EXPECT_TRUE(tells(scene));
  scene.add(100, 90);
  EXPECT_FALSE(tells(scene));
  scene.add(100, 0);
  scene.forget_points();
  EXPECT_FALSE(tells(scene));
}

TEST(MovingScene, fewNewPointsAtATimeAreJudgedTogether) {
  MovingScene scene;
  scene.add(40, 0);  // one blurred frame
  ASSERT_TRUE(tells(scene));
  scene.add(12, 10);
  scene.add(12, 10);
  EXPECT_TRUE(tells(scene)) << "24 are not enough";
  scene.add(12, 10);
  EXPECT_FALSE(tells(scene));
  for (int i = 0; i < 3; ++i) scene.add(12, 1);
  EXPECT_TRUE(tells(scene)) << "few new points, and nearly all of them lost";
}

TEST(MovingScene, isToldForTenFramesAlsoWhenTheMapIsMadeAnew) {
  MovingScene scene;
  EXPECT_TRUE(scene.judge(true, true));
  scene.tell();
  scene.forget_points();
  for (int i = 0; i < 9; ++i) {
    EXPECT_TRUE(scene.judge(false, true)) << i;
    scene.tell();
  }
  EXPECT_FALSE(scene.judge(false, true));
}

TEST(MovingScene, aFrameThatHadAnotherReasonIsToldAlone) {
  MovingScene scene;
  EXPECT_TRUE(scene.judge(true, true));
  EXPECT_FALSE(scene.judge(false, true));
}

TEST(MovingScene, newPointsSayNothingWithoutACalibration) {
  MovingScene scene;
  scene.add(100, 0);
  EXPECT_FALSE(scene.judge(false, false));
  EXPECT_TRUE(scene.judge(true, false));
}

}  // namespace
}  // namespace vergence::odometry
