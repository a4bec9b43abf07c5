#include "core/memory/allocation_guard.hpp"

#include <gtest/gtest.h>
#include <stdlib.h>
#include <string.h>

#include <new>
#include <thread>
#include <vector>

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

}  // namespace
}  // namespace vergence
