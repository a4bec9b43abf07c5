#include "app/session/heartbeat.hpp"

#include <gtest/gtest.h>

namespace vergence::app {
namespace {

/// Whether the next look finds another number.
bool beats(Heartbeat* heart, std::uint64_t items, bool waiting, std::uint64_t rounds) {
  const std::uint64_t before = heart->beats(items, false, rounds - 1);
  return heart->beats(items, waiting, rounds) != before;
}

TEST(Heartbeat, aLoopThatWaitsIsAliveWhileTheDevicesThreadGoesRound) {
  Heartbeat heart;
  std::uint64_t last = heart.beats(7, true, 1);
  for (std::uint64_t round = 2; round < 100; ++round) {
    const std::uint64_t now = heart.beats(7, true, round);
    EXPECT_NE(now, last) << round;
    last = now;
  }
}

TEST(Heartbeat, whereADeviceHoldsUpThatThreadItIsNot) {
  Heartbeat heart;
  const std::uint64_t last = heart.beats(7, true, 5);
  for (int look = 0; look < 100; ++look) EXPECT_EQ(heart.beats(7, true, 5), last);
  EXPECT_NE(heart.beats(7, true, 6), last) << "it was slow";
}

TEST(Heartbeat, anEstimatorThatHangsIsNotAliveWhateverTheDevicesDo) {
  Heartbeat heart;
  EXPECT_FALSE(beats(&heart, 7, false, 10));
  EXPECT_TRUE(beats(&heart, 7, true, 20));
  EXPECT_FALSE(beats(&heart, 7, false, 30)) << "it works on what it was given";
}

}  // namespace
}  // namespace vergence::app
