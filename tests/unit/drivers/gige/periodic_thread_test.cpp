#include "drivers/gige/detail/gige_camera.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <thread>

namespace vergence::gige {
namespace {

constexpr Duration kOften = Duration::milliseconds(1);

void wait_until(const std::atomic<int>& rounds, int at_least) {
  while (rounds < at_least) std::this_thread::yield();
}

TEST(GigePeriodicThread, goesOnUntilItIsStoppedAndCanBeStartedAgain) {
  std::atomic<int> rounds{0};
  PeriodicThread thread;
  for (int start = 0; start < 2; ++start) {
    rounds = 0;
    thread.start("vergence-test", kOften, [&] { ++rounds; });
    wait_until(rounds, 3);
    thread.stop();
    const int stopped = rounds;
    EXPECT_FALSE(thread.stopping());
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    EXPECT_EQ(rounds, stopped);
  }
}

TEST(GigePeriodicThread, aSecondStartChangesNothing) {
  std::atomic<int> first{0}, second{0};
  PeriodicThread thread;
  thread.start("vergence-test", kOften, [&] { ++first; });
  thread.start("vergence-test", kOften, [&] { ++second; });
  wait_until(first, 2);
  thread.stop();
  EXPECT_EQ(second, 0);
}

TEST(GigePeriodicThread, aLongRoundSeesThatSomebodyWaitsForIt) {
  std::atomic<int> rounds{0};
  PeriodicThread thread;
  thread.start("vergence-test", kOften, [&] {
    ++rounds;
    while (!thread.stopping()) std::this_thread::yield();
  });
  wait_until(rounds, 1);
  thread.stop();
  EXPECT_EQ(rounds, 1);
}

}  // namespace
}  // namespace vergence::gige
