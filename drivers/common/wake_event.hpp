#pragma once
#include <atomic>
#include <cstdint>

namespace vergence {

/// Wakes a thread that waits for something to change elsewhere (a ring that was empty or full). Not
/// for the real-time path: wait() sleeps in the kernel.
///
///     for (;;) {
///       const WakeEvent::Ticket seen = event.ticket();  // before the look at the ring, so that
///       if (ring.pop(&item)) break;                     // what is pushed in between is not missed
///       event.wait(seen);
///     }
///
/// Threads  Everything from any thread. No heap; signal() makes a system call only when a thread
///          waits.
class WakeEvent {
 public:
  using Ticket = std::uint32_t;  // the width a futex has: waiting needs no proxy

  [[nodiscard]] Ticket ticket() const noexcept { return count_.load(std::memory_order_acquire); }
  void signal() noexcept {
    count_.fetch_add(1, std::memory_order_release);
    count_.notify_all();
  }
  /// Returns when signal() was called after that ticket().
  void wait(Ticket seen) const noexcept { count_.wait(seen, std::memory_order_acquire); }

 private:
  std::atomic<Ticket> count_{0};
};

}  // namespace vergence
