#pragma once
#include <cstdint>

namespace vergence {

/// Counts heap allocations made by threads that have promised to make none.
///
/// Works where the program links `vergence_core_memory_hooks`, which puts itself before the C
/// library's malloc family; elsewhere (sanitizer builds bring their own) available() is false and
/// the count stays 0.
/// Threads  seal_thread() and unseal_thread() act on the calling thread; the counter is common to
///          all.
class AllocationGuard {
 public:
  [[nodiscard]] static bool available() noexcept;
  static void seal_thread() noexcept;
  static void unseal_thread() noexcept;
  [[nodiscard]] static bool thread_sealed() noexcept;
  /// Allocations on sealed threads since the program's start.
  [[nodiscard]] static std::uint64_t runtime_allocations() noexcept;
  /// From now on an allocation on a sealed thread aborts (tests: the debugger then stands at the
  /// culprit).
  static void abort_on_allocation(bool on) noexcept;

  /// For the hooks only: an allocation has happened on this thread.
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
