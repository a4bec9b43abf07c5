#include "app/runtime/background_thread.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <vector>

namespace vergence::app {
namespace {

TEST(BackgroundThread, startDoesNotWaitForTheTask) {
  BackgroundThread runner;
  std::atomic<bool> go{false};
  std::thread::id where;
  auto task = [&] {
    go.wait(false);
    where = std::this_thread::get_id();
  };
  EXPECT_FALSE(runner.busy());
  runner.start(TaskRef(task));
  EXPECT_TRUE(runner.busy()) << "the task waits for us";
  go = true;
  go.notify_one();
  runner.wait();
  EXPECT_FALSE(runner.busy());
  EXPECT_NE(where, std::this_thread::get_id());
}

TEST(BackgroundThread, resultIsVisibleWhenNotBusy) {
  BackgroundThread runner;
  // The array is not atomic, so reading it too early would be a race.
  std::array<int, 64> written{};
  int expected = 0;
  auto task = [&] {
    for (int& w : written) ++w;
  };
  for (int i = 0; i < 300; ++i) {
    runner.start(TaskRef(task));
    ++expected;
    if (i % 2 == 0)
      runner.wait();
    else
      while (runner.busy()) std::this_thread::yield();
    for (const int w : written) ASSERT_EQ(w, expected);
  }
}

TEST(ThreadRunner, runsOneHalfOnEachThread) {
  ThreadRunner runner;
  std::thread::id there_id[2];
  std::atomic<int> started{0};
  for (int i = 0; i < 2; ++i) {
    // Until the second half has started, the caller may still run it.
    auto here = [&] {
      while (started <= i) std::this_thread::yield();
    };
    auto there = [&] {
      there_id[i] = std::this_thread::get_id();
      ++started;
    };
    runner.run(TaskRef(here), TaskRef(there));
  }
  EXPECT_NE(there_id[0], std::this_thread::get_id());
  EXPECT_EQ(there_id[0], there_id[1]);
}

TEST(ThreadRunner, endsWhenItsHalvesHaveJustRun) {
  auto nothing = [] {};
  for (int i = 0; i < 2000; ++i) {
    ThreadRunner runner;
    for (int k = 0; k < 3; ++k) runner.run(TaskRef(nothing), TaskRef(nothing));
  }
}

TEST(ThreadRunner, everyIndexIsVisitedOnceWithEitherRunner) {
  ThreadRunner two;
  SequentialRunner one;
  for (PairRunner* runner : {static_cast<PairRunner*>(&two), static_cast<PairRunner*>(&one)})
    for (const std::size_t n : {0U, 1U, 2U, 31U, 32U, 33U, 1000U}) {
      std::vector<int> visits(n);
      for_each_index(*runner, n, [&](std::size_t i) noexcept { ++visits[i]; });
      EXPECT_EQ(std::count(visits.begin(), visits.end(), 1), static_cast<std::ptrdiff_t>(n));
    }
}

TEST(ThreadRunner, waitsForTheSlowerHalf) {
  ThreadRunner runner;
  // The counters are not atomic, so a run that returned early would be a race.
  int left = 0, right = 0;
  const auto pause = [](int i) {
    // Longer than both sides spin now and then, so that sleeping and waking are walked, too.
    if (i % 500 == 0) std::this_thread::sleep_for(std::chrono::microseconds(300));
  };
  for (int i = 0; i < 5000; ++i) {
    auto here = [&] {
      if (i % 1000 == 0) pause(i);
      ++left;
    };
    auto there = [&] {
      if (i % 1000 == 500) pause(i);
      ++right;
    };
    runner.run(TaskRef(here), TaskRef(there));
    ASSERT_EQ(left, i + 1);
    ASSERT_EQ(right, i + 1);
  }
}

}  // namespace
}  // namespace vergence::app
