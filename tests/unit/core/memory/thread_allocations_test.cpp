#include "core/memory/thread_allocations.hpp"

#include <gtest/gtest.h>
#include <pthread.h>
#include <stdlib.h>

#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "core/memory/allocation_guard.hpp"

namespace vergence {
namespace {

void allocate(int times) {
  for (int i = 0; i < times; ++i) {
    void* volatile p = malloc(64);
    free(p);
  }
}

/// A thread of that name that allocates so often.
void run_named(const std::string& name, int times) {
  std::thread([&name, times] {
    (void)pthread_setname_np(pthread_self(), name.c_str());
    allocate(times);
  }).join();
}

std::optional<std::uint64_t> count_of(const std::string& name) {
  const ThreadAllocations::Counts counts = ThreadAllocations::counts();
  for (std::size_t i = 0; i < counts.size; ++i)
    if (name == counts.rows[i].name.data()) return counts.rows[i].count;
  return std::nullopt;
}

class ThreadAllocationsTest : public testing::Test {
 protected:
  void SetUp() override {
    if (!AllocationGuard::available())
      GTEST_SKIP() << "needs the allocation hooks; run it in a build without VERGENCE_SANITIZE";
  }
  void TearDown() override { ThreadAllocations::end(); }
};

TEST_F(ThreadAllocationsTest, eachThreadNameHasItsOwnCount) {
  ThreadAllocations::begin();
  run_named("vergence-one", 3);
  run_named("vergence-two", 5);
  run_named("gmain", 2);
  ThreadAllocations::end();
  EXPECT_EQ(count_of("vergence-one"), 3U);
  EXPECT_EQ(count_of("vergence-two"), 5U);
  EXPECT_EQ(count_of("gmain"), 2U);
}

TEST_F(ThreadAllocationsTest, threadIsCountedAgainInTheNextCount) {
  int step = 0;
  std::thread worker;
  pthread_barrier_t barrier;
  ASSERT_EQ(pthread_barrier_init(&barrier, nullptr, 2), 0);
  worker = std::thread([&] {
    (void)pthread_setname_np(pthread_self(), "vergence-long");
    for (step = 0; step < 2; ++step) {
      (void)pthread_barrier_wait(&barrier);
      allocate(2 + step);
      (void)pthread_barrier_wait(&barrier);
    }
  });
  for (const std::uint64_t expected : {2U, 3U}) {
    ThreadAllocations::begin();
    // The other thread takes the row that was the worker's.
    if (expected == 3U) run_named("vergence-other", 1);
    (void)pthread_barrier_wait(&barrier);
    (void)pthread_barrier_wait(&barrier);
    ThreadAllocations::end();
    EXPECT_EQ(count_of("vergence-long"), expected);
  }
  worker.join();
  (void)pthread_barrier_destroy(&barrier);
}

TEST_F(ThreadAllocationsTest, fullTableCountsTheRestTogether) {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < ThreadAllocations::kMaxNames + 3; ++i)
    names.push_back("vergence-t" + std::to_string(i));
  ThreadAllocations::begin();
  run_named(names[0], 1);
  for (const std::string& name : names) run_named(name, 1);
  ThreadAllocations::end();
  const ThreadAllocations::Counts counts = ThreadAllocations::counts();
  EXPECT_EQ(counts.size, ThreadAllocations::kMaxNames);
  // There are three, and a fourth if this thread itself has taken a row.
  EXPECT_GE(counts.others, 3U);
  EXPECT_EQ(count_of(names[0]), 2U);
  EXPECT_EQ(count_of(names.back()), std::nullopt);
}

}  // namespace
}  // namespace vergence
