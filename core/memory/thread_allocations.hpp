#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

namespace vergence {

/// Counts heap allocations of every thread of the program between begin() and end(), by its kernel
/// name (pthread_setname_np; prctl(2), PR_GET_NAME). This includes threads of libraries; threads of
/// the same name share a row.
///
/// Requires linking `vergence_core_memory_hooks`, as AllocationGuard does.
/// Memory   A fixed table; allocations of threads that do not fit count as `others`.
/// Threads  All functions from any thread. Allocations during begin() may count on either side.
class ThreadAllocations {
 public:
  static constexpr std::size_t kMaxNames = 32;
  /// Size of a kernel thread name with its final zero.
  static constexpr std::size_t kNameBytes = 16;

  struct Row {
    /// Ends with a zero.
    std::array<char, kNameBytes> name{};
    std::uint64_t count = 0;
  };
  struct Counts {
    /// The first `size` rows are valid, in order of their first allocation.
    std::array<Row, kMaxNames> rows{};
    std::size_t size = 0;
    /// Allocations of threads that did not fit into the table.
    std::uint64_t others = 0;
  };

  /// Clears the table and counts from now on.
  static void begin() noexcept;
  /// Stops counting; the table stays.
  static void end() noexcept;
  [[nodiscard]] static Counts counts() noexcept;

  /// Called by the hooks at an allocation on this thread.
  static void record_allocation() noexcept;

 private:
  static void count() noexcept;
};

}  // namespace vergence
