#include "core/memory/allocation_guard.hpp"

#include <atomic>

namespace vergence {
namespace {

// Constant-initialised thread-local storage, because reading it inside malloc must not allocate.
thread_local constinit bool sealed = false;
std::atomic<std::uint64_t> count{0};
std::atomic<bool> hooked{false};

}  // namespace

bool AllocationGuard::available() noexcept { return hooked.load(std::memory_order_relaxed); }
void AllocationGuard::seal_thread() noexcept { sealed = true; }
void AllocationGuard::unseal_thread() noexcept { sealed = false; }
bool AllocationGuard::thread_sealed() noexcept { return sealed; }
std::uint64_t AllocationGuard::runtime_allocations() noexcept {
  return count.load(std::memory_order_relaxed);
}

void AllocationGuard::record_allocation() noexcept {
  if (sealed) count.fetch_add(1, std::memory_order_relaxed);
}

void AllocationGuard::set_available() noexcept { hooked.store(true, std::memory_order_relaxed); }

}  // namespace vergence
