// Overrides glibc's allocator in programs that link it, so that every allocation of every library
// passes here. glibc exports its own functions under these names for this purpose.
#include <cerrno>
#include <cstddef>

#include "core/memory/allocation_guard.hpp"
#include "core/memory/thread_allocations.hpp"

namespace {

void count_allocation() noexcept {
  vergence::AllocationGuard::record_allocation();
  vergence::ThreadAllocations::record_allocation();
}

}  // namespace

extern "C" {

// NOLINTBEGIN(bugprone-reserved-identifier,readability-identifier-naming): the C library chose
// these names
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);
void* __libc_valloc(std::size_t);
void* __libc_pvalloc(std::size_t);
// NOLINTEND(bugprone-reserved-identifier,readability-identifier-naming)

void* malloc(std::size_t size) {
  count_allocation();
  return __libc_malloc(size);
}

void* calloc(std::size_t n, std::size_t size) {
  count_allocation();
  return __libc_calloc(n, size);
}

void* realloc(void* p, std::size_t size) {
  count_allocation();
  return __libc_realloc(p, size);
}

void* memalign(std::size_t alignment, std::size_t size) {
  count_allocation();
  return __libc_memalign(alignment, size);
}

void* valloc(std::size_t size) {
  count_allocation();
  return __libc_valloc(size);
}

void* pvalloc(std::size_t size) {
  count_allocation();
  return __libc_pvalloc(size);
}

void* aligned_alloc(std::size_t alignment, std::size_t size) { return memalign(alignment, size); }

int posix_memalign(void** out, std::size_t alignment, std::size_t size) {
  void* p = memalign(alignment, size);
  if (p == nullptr) return ENOMEM;
  *out = p;
  return 0;
}

}  // extern "C"

namespace {
const bool kAnnounced = (vergence::AllocationGuard::set_available(), true);
}
