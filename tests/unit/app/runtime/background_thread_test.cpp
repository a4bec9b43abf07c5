#include "app/runtime/background_thread.hpp"

#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <chrono>
#include <thread>

#include "core/memory/allocation_guard.hpp"

namespace vergence::app {
namespace {

TEST(BackgroundThread, startReturnsWhileTheTaskRunsOnTheOtherThread) {
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

TEST(BackgroundThread, whatATaskWroteIsThereWhenItIsNoLongerBusy) {
  BackgroundThread runner;
  std::array<int, 64> written{};  // plain: seen too early it would be a race
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

TEST(BackgroundThread, allocatesNothingPerTaskAndSealsItsThread) {
  if (!AllocationGuard::available())
    GTEST_SKIP() << "needs the allocation hooks, which sanitizer builds leave out";
  BackgroundThread runner;
  bool sealed = false;
  auto look = [&] { sealed = AllocationGuard::thread_sealed(); };
  const auto before = AllocationGuard::allocations_after_seal();
  {
    const SealedScope scope;
    for (int i = 0; i < 200; ++i) {
      runner.start(TaskRef(look));
      runner.wait();
    }
  }
  EXPECT_TRUE(sealed);
  EXPECT_EQ(AllocationGuard::allocations_after_seal(), before);
}

}  // namespace
}  // namespace vergence::app
