#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

namespace vergence {

/// Counts heap allocations of every thread of the program by the name the kernel has for it
/// (pthread_setname_np; prctl(2), PR_GET_NAME), between begin() and end(). Threads of a library are
/// counted alike, under the names that the library gives them; threads of one name share a row.
///
/// Works where AllocationGuard does: in a program that links `vergence_core_memory_hooks`.
/// Memory   A fixed table; what a thread allocates once the table is full goes to `others`.
/// Threads  All functions from any thread. begin() while threads allocate may give a few of the
///          calls of that moment to either side.
/// Debugger A breakpoint on `vergence::ThreadAllocations::count` stops at every counted allocation.
class ThreadAllocations {
 public:
  static constexpr std::size_t kMaxNames = 32;
  static constexpr std::size_t kNameBytes = 16;  // of the kernel, the final zero included

  struct Row {
    std::array<char, kNameBytes> name{};  // ends with a zero
    std::uint64_t count = 0;
  };
  struct Counts {
    std::array<Row, kMaxNames> rows{};  // `size` of them, in order of their first allocation
    std::size_t size = 0;
    std::uint64_t others = 0;  // of threads that had no place in the table
  };

  /// Clears the table and counts from now on.
  static void begin() noexcept;
  /// Counts no longer; the table stays.
  static void end() noexcept;
  [[nodiscard]] static Counts counts() noexcept;

  /// For the hooks only: an allocation has happened on this thread.
  static void record_allocation() noexcept;

 private:
  static void count() noexcept;
};

}  // namespace vergence
