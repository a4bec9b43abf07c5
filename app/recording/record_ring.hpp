#pragma once
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <span>

#include "core/memory/arena.hpp"

namespace vergence::app {

/// Bounded queue of byte records between one producer thread and one consumer thread.
///
/// The memory is mapped twice in a row, so every record, and everything that waits, lies in one
/// piece: the consumer writes it to a file as it is, without a copy.
/// Threads  begin(), commit(): producer. waiting(), release(): consumer. fill(): any, a guess.
/// Memory   All at construction, present; no heap, no lock and no system call after.
/// Full     begin() refuses. A record may be asked to leave `spare` bytes free, so that large ones
///          never push out small ones.
/// Errors   The constructor throws std::system_error.
class RecordRing {
 public:
  /// `bytes` is rounded up to whole pages.
  explicit RecordRing(std::size_t bytes);
  ~RecordRing();
  RecordRing(const RecordRing&) = delete;
  RecordRing& operator=(const RecordRing&) = delete;

  /// Where a record of `size` bytes is to be written; empty: there is no room. Gone with the next
  /// begin() unless committed.
  [[nodiscard]] std::span<std::uint8_t> begin(std::size_t size, std::size_t spare) noexcept;
  /// The first `size` bytes of what begin() gave are a record.
  void commit(std::size_t size) noexcept;

  /// Everything committed and not yet released, oldest first.
  [[nodiscard]] std::span<const std::uint8_t> waiting() const noexcept;
  /// The first `size` bytes of waiting() are not needed any more.
  void release(std::size_t size) noexcept;

  [[nodiscard]] std::size_t capacity() const noexcept { return capacity_; }
  [[nodiscard]] std::size_t fill() const noexcept {
    return static_cast<std::size_t>(tail_.load(std::memory_order_acquire) -
                                    head_.load(std::memory_order_acquire));
  }
  /// Most bytes that ever waited; exact for the producer.
  [[nodiscard]] std::size_t high_water() const noexcept {
    return high_water_.load(std::memory_order_relaxed);
  }

 private:
  std::size_t capacity_ = 0;
  std::uint8_t* memory_ = nullptr;
  // 64 bits on every machine: the place in the ring is the count modulo a capacity that is no power
  // of two, which jumps where a count wraps.
  using Count = std::uint64_t;
  [[nodiscard]] std::uint8_t* place(Count count) const noexcept {
    return memory_ + static_cast<std::size_t>(count % capacity_);
  }
  static_assert(std::atomic<Count>::is_always_lock_free);
  alignas(kCacheLine) std::atomic<Count> head_{0};  // bytes released since the start
  alignas(kCacheLine) std::atomic<Count> tail_{0};  // bytes committed since the start
  std::atomic<std::size_t> high_water_{0};
};

}  // namespace vergence::app
