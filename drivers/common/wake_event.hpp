#pragma once
#include <atomic>
#include <cstdint>

namespace vergence {

/// Wakes a thread that waits for a change made by another thread (a ring that was empty or full).
/// Not for the real-time path: wait() sleeps in the kernel.
///
///     for (;;) {
///       const WakeEvent::Ticket seen = event.ticket();  // before the look at the ring, so that
///       if (ring.pop(&item)) break;                     // what is pushed in between is not missed
///       event.wait(seen);
///     }
///
/// Every call is thread-safe and does not allocate. signal() makes a system call only if a thread
/// waits.
class WakeEvent {
 public:
  /// Has the width of a futex, so that waiting needs no proxy.
  using Ticket = std::uint32_t;

  [[nodiscard]] Ticket ticket() const noexcept { return count_.load(std::memory_order_acquire); }
  void signal() noexcept {
    count_.fetch_add(1, std::memory_order_release);
    count_.notify_all();
  }
  /// Returns once signal() was called after this ticket().
  void wait(Ticket seen) const noexcept { count_.wait(seen, std::memory_order_acquire); }

 private:
  std::atomic<Ticket> count_{0};
};

}  // namespace vergence
