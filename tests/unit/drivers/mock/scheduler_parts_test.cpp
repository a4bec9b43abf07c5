#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "drivers/mock/detail/scheduler.hpp"

namespace vergence::mock {
namespace {

TEST(PauseWindow, leavesOutItsSlotsOnce) {
  PauseWindow pauses;
  EXPECT_FALSE(pauses.make(0, 7));
  pauses.request(2, 2, 7);
  EXPECT_FALSE(pauses.make(1, 7));
  EXPECT_TRUE(pauses.make(2, 7));
  EXPECT_TRUE(pauses.make(3, 7));
  EXPECT_FALSE(pauses.make(4, 7));
}

TEST(PauseWindow, beginsBehindTheSlotsThatWereMade) {
  PauseWindow pauses;
  for (std::uint64_t slot = 0; slot < 5; ++slot) EXPECT_FALSE(pauses.make(slot, 7));
  pauses.request(1, 2, 7);
  EXPECT_TRUE(pauses.make(5, 7));
  EXPECT_TRUE(pauses.make(6, 7));
  EXPECT_FALSE(pauses.make(7, 7));
}

TEST(PauseWindow, endsWithTheBootItWasAskedOfUnlessItIsForAny) {
  PauseWindow pauses;
  pauses.request(0, 9, 7);
  EXPECT_TRUE(pauses.make(0, 7));
  EXPECT_FALSE(pauses.make(1, 8));
  EXPECT_FALSE(pauses.make(2, 7)) << "it is over";
  pauses.request(0, 9, 0);
  EXPECT_TRUE(pauses.make(3, 8));
}

TEST(PulseFeed, givesTimesInTheirOrderAndThenTheEnd) {
  const std::atomic<bool> stop{false};
  PulseFeed feed(stop);
  feed.push(Duration::milliseconds(1));
  feed.push(Duration::milliseconds(2));
  feed.end();
  feed.push(Duration::milliseconds(3));
  EXPECT_EQ(feed.next(), Duration::milliseconds(1));
  EXPECT_EQ(feed.next(), Duration::milliseconds(2));
  EXPECT_EQ(feed.next(), std::nullopt);
}

TEST(PulseFeed, aStopEndsTheWaiting) {
  std::atomic<bool> stop{false};
  PulseFeed feed(stop);
  std::optional<Duration> got = Duration{};
  std::thread waiting([&] { got = feed.next(); });
  stop = true;
  feed.wake();
  waiting.join();
  EXPECT_EQ(got, std::nullopt);
}

}  // namespace
}  // namespace vergence::mock
