#pragma once
#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <type_traits>

#include "core/memory/arena.hpp"

namespace vergence {

/// Bounded queue between exactly one producer thread and one consumer thread; N is a power of two.
///
/// Threads  push(), full(): producer. pop(), empty(): consumer. size() is exact for neither; use it
///          for statistics.
/// Memory   In place; no heap, lock or system call. If full, push() returns false and the caller's
///          policy applies.
template <class T, std::size_t N>
class Ring {
  static_assert(N > 0 && (N & (N - 1)) == 0, "a power of two, so that counters wrap");
  static_assert(std::is_trivially_destructible_v<T>, "slot handles and small values only");

 public:
  /// Returns false and changes nothing if full.
  [[nodiscard]] bool push(const T& value) noexcept {
    const std::size_t tail = tail_.load(std::memory_order_relaxed);
    if (tail - head_.load(std::memory_order_acquire) == N) return false;
    items_[tail & (N - 1)] = value;
    tail_.store(tail + 1, std::memory_order_release);
    return true;
  }
  /// Returns false and leaves *value unchanged if empty.
  [[nodiscard]] bool pop(T* value) noexcept {
    const std::size_t head = head_.load(std::memory_order_relaxed);
    if (tail_.load(std::memory_order_acquire) == head) return false;
    *value = items_[head & (N - 1)];
    head_.store(head + 1, std::memory_order_release);
    return true;
  }
  /// Exact for the consumer, for which it can only become less empty.
  [[nodiscard]] bool empty() const noexcept {
    return tail_.load(std::memory_order_acquire) == head_.load(std::memory_order_acquire);
  }
  /// Exact for the producer, for which it can only become less full.
  [[nodiscard]] bool full() const noexcept { return size() == N; }
  [[nodiscard]] std::size_t size() const noexcept {
    // Read the head first, which never passes a tail that is read later. Both may advance in
    // between.
    const std::size_t head = head_.load(std::memory_order_acquire);
    return std::min(tail_.load(std::memory_order_acquire) - head, N);
  }
  [[nodiscard]] static constexpr std::size_t capacity() noexcept { return N; }

 private:
  // Separate cache lines avoid false sharing.
  alignas(kCacheLine) std::atomic<std::size_t> head_{0};
  alignas(kCacheLine) std::atomic<std::size_t> tail_{0};
  alignas(kCacheLine) std::array<T, N> items_{};
};

}  // namespace vergence
