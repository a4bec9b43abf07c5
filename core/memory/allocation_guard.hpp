#pragma once
#include <cstdint>

namespace vergence {

/// Counts heap allocations of threads that must not allocate.
///
/// Requires linking `vergence_core_memory_hooks`, which overrides the C library's malloc family;
/// otherwise (for example in sanitizer builds) available() is false and the count stays 0.
/// Threads  seal_thread() and unseal_thread() act on the calling thread; the counter is common to
///          all.
class AllocationGuard {
 public:
  [[nodiscard]] static bool available() noexcept;
  static void seal_thread() noexcept;
  static void unseal_thread() noexcept;
  [[nodiscard]] static bool thread_sealed() noexcept;
  /// Number of allocations on sealed threads since the program's start.
  [[nodiscard]] static std::uint64_t runtime_allocations() noexcept;

  /// Called by the hooks at an allocation on this thread.
  static void record_allocation() noexcept;
  static void set_available() noexcept;
};

/// Seals the thread for a scope.
class SealedScope {
 public:
  SealedScope() noexcept : was_(AllocationGuard::thread_sealed()) {
    AllocationGuard::seal_thread();
  }
  ~SealedScope() {
    if (!was_) AllocationGuard::unseal_thread();
  }
  SealedScope(const SealedScope&) = delete;
  SealedScope& operator=(const SealedScope&) = delete;

 private:
  bool was_;
};

}  // namespace vergence
