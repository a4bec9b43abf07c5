#pragma once
#include <gtest/gtest.h>

#include "core/memory/allocation_guard.hpp"

namespace vergence::test {

/// Fails unless `work` leaves the heap alone; it runs on this thread, which is sealed meanwhile.
template <class Work>
void expect_no_allocations(const Work& work) {
  const std::uint64_t before = AllocationGuard::runtime_allocations();
  {
    const SealedScope sealed;
    work();
  }
  EXPECT_EQ(AllocationGuard::runtime_allocations(), before);
}

}  // namespace vergence::test
