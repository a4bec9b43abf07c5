#pragma once
#include <atomic>
#include <cstdint>

namespace vergence::app {

/// Wakes a thread that waits for something to change elsewhere (a ring that was empty or full). Not
/// for the real-time path: wait() sleeps in the kernel.
///
///     for (;;) {
///       const WakeEvent::Rung seen = bell.look();   // before the look at the ring: a ring in
///       between is not missed if (ring.pop(&item)) break; bell.wait(seen);
///     }
///
/// Threads  Everything from any thread. No heap; ring() makes a system call only when somebody
///          waits.
class WakeEvent {
 public:
  using Rung = std::uint32_t;  // the width a futex has: waiting needs no proxy

  [[nodiscard]] Rung look() const noexcept { return rung_.load(std::memory_order_acquire); }
  void ring() noexcept {
    rung_.fetch_add(1, std::memory_order_release);
    rung_.notify_all();
  }
  /// Returns when ring() was called after that look().
  void wait(Rung seen) const noexcept { rung_.wait(seen, std::memory_order_acquire); }

 private:
  std::atomic<Rung> rung_{0};
};

}  // namespace vergence::app
