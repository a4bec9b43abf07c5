#include "core/estimator/detail/window_doubt.hpp"

#include <gtest/gtest.h>

namespace vergence {
namespace {

int doubted_after(WindowDoubt doubt) {
  int frames = 0;
  while (doubt.next() != Reason::none) ++frames;
  return frames;
}

TEST(WindowDoubt, lastsAsManyFramesAsWereDoubtedOfAWindowAtMost) {
  WindowDoubt doubt;
  EXPECT_EQ(doubted_after(doubt), 0);
  doubt.add(Reason::recalibrating, 1);
  doubt.add(Reason::recalibrating, 1);
  EXPECT_EQ(doubt.next(), Reason::recalibrating);
  EXPECT_EQ(doubted_after(doubt), 1);
  for (int i = 0; i < 100; ++i) doubt.add(Reason::recalibrating, 1);
  EXPECT_EQ(doubted_after(doubt), WindowDoubt::kWindow);
  doubt.add(Reason::time_gap, WindowDoubt::kWindow);
  EXPECT_EQ(doubt.next(), Reason::time_gap);
}

TEST(WindowDoubt, ofANewSceneThereIsNone) {
  WindowDoubt doubt;
  doubt.add(Reason::time_gap, WindowDoubt::kWindow);
  doubt.clear();
  EXPECT_EQ(doubted_after(doubt), 0);
}

}  // namespace
}  // namespace vergence
