#include "core/memory/allocation_guard.hpp"

#include <gtest/gtest.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

#include <new>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "core/memory/thread_allocations.hpp"

namespace vergence {
namespace {

/// Where an address goes so that the compiler cannot drop the allocation.
void* volatile sink = nullptr;

/// Allocations that `work` makes on this thread once it is sealed.
std::uint64_t counted(void (*work)()) {
  const std::uint64_t before = AllocationGuard::runtime_allocations();
  {
    const SealedScope sealed;
    work();
  }
  return AllocationGuard::runtime_allocations() - before;
}

class AllocationGuardTest : public testing::Test {
 protected:
  void SetUp() override {
    if (!AllocationGuard::available())
      GTEST_SKIP() << "needs the allocation hooks; run it in a build without VERGENCE_SANITIZE";
  }
};

TEST_F(AllocationGuardTest, everyHeapFunctionIsCounted) {
  EXPECT_EQ(counted([] { sink = malloc(8); }), 1U);
  free(sink);
  EXPECT_EQ(counted([] { sink = calloc(2, 8); }), 1U);
  EXPECT_EQ(counted([] { sink = realloc(sink, 4096); }), 1U);
  EXPECT_EQ(counted([] { sink = reallocarray(sink, 3, 4096); }), 1U);
  free(sink);
  EXPECT_EQ(counted([] { sink = aligned_alloc(64, 128); }), 1U);
  free(sink);
  EXPECT_EQ(counted([] {
              void* p = nullptr;
              if (posix_memalign(&p, 64, 128) == 0) sink = p;
            }),
            1U);
  EXPECT_EQ(reinterpret_cast<std::uintptr_t>(sink) % 64, 0U);
  free(sink);
  EXPECT_EQ(counted([] { sink = valloc(100); }), 1U);
  free(sink);
  EXPECT_EQ(counted([] { sink = new int(3); }), 1U);
  delete static_cast<int*>(sink);
  EXPECT_EQ(counted([] { sink = ::operator new (256, std::align_val_t{64}); }), 1U);
  ::operator delete (sink, std::align_val_t{64});
  EXPECT_EQ(counted([] { sink = strdup("a line from the C library"); }), 1U);
  free(sink);
}

TEST_F(AllocationGuardTest, unsealedThreadIsNotCounted) {
  const std::uint64_t before = AllocationGuard::runtime_allocations();
  std::uint64_t inside = 1;
  std::thread other([&inside] {
    const std::uint64_t start = AllocationGuard::runtime_allocations();
    sink = malloc(1000);
    free(sink);
    inside = AllocationGuard::runtime_allocations() - start;
  });
  {
    const SealedScope sealed;
    other.join();
  }
  EXPECT_EQ(inside, 0U);
  EXPECT_EQ(AllocationGuard::runtime_allocations(), before);
}

TEST_F(AllocationGuardTest, everySealedThreadIsCounted) {
  const std::uint64_t before = AllocationGuard::runtime_allocations();
  std::vector<std::thread> threads;
  for (int i = 0; i < 3; ++i)
    threads.emplace_back([] {
      const SealedScope sealed;
      void* volatile p = malloc(32);
      free(p);
    });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(AllocationGuard::runtime_allocations() - before, 3U);
}

TEST_F(AllocationGuardTest, nestedScopesStaySealed) {
  EXPECT_FALSE(AllocationGuard::thread_sealed());
  {
    const SealedScope outer;
    { const SealedScope inner; }
    EXPECT_TRUE(AllocationGuard::thread_sealed());
  }
  EXPECT_FALSE(AllocationGuard::thread_sealed());
}

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
