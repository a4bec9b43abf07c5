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

}  // namespace
}  // namespace vergence::gige
