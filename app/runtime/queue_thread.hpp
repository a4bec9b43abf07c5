#pragma once
#include <pthread.h>

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <thread>
#include <utility>

#include "core/memory/ring.hpp"
#include "drivers/common/wake_event.hpp"

namespace vergence::app {

/// Policy for the newest item if a queue is full: its producer waits (replay, virtual time), or the
/// item is dropped (live).
enum class WhenFull : std::uint8_t { wait, drop };

/// Bounded queue and the thread that reads it, for producers that must not wait for a disk.
///
/// Threads  The owner calls start() and, after the last post(), stop(). One producer calls post()
///          and high_water().
/// Memory   Fixed; post() does not allocate.
/// Errors   start() throws std::system_error if there is no thread.
template <class Item, std::size_t N>
class QueueThread {
 public:
  explicit QueueThread(WhenFull when_full) noexcept : when_full_(when_full) {}
  ~QueueThread() { stop(); }

  /// Calls `begin` first on the thread, then `handle` with every item in order, and with null
  /// whenever the queue is empty.
  template <class Begin, class Handle>
  void start(const char* name, Begin begin, Handle handle) {
    thread_ = std::thread([this, name, begin = std::move(begin), handle = std::move(handle)] {
      (void)pthread_setname_np(pthread_self(), name);
      begin();
      for (Item item;;) {
        const WakeEvent::Ticket seen = filled_.ticket();
        // Read before the ring, so that items posted before stop() are found.
        const bool stopping = stop_.load(std::memory_order_acquire);
        if (ring_.pop(&item)) {
          freed_.signal();
          handle(&item);
        } else if (stopping) {
          return;
        } else {
          handle(static_cast<const Item*>(nullptr));
          filled_.wait(seen);
        }
      }
    });
  }

  /// Returns false if the item was dropped. If items are dropped, `spare` places stay free for
  /// others.
  bool post(const Item& item, std::size_t spare = 0) noexcept {
    for (;;) {
      const WakeEvent::Ticket seen = freed_.ticket();
      if (when_full_ == WhenFull::drop && ring_.size() + spare >= N) return false;
      if (ring_.push(item)) break;
      freed_.wait(seen);
    }
    high_water_ = std::max(high_water_, ring_.size());
    filled_.signal();
    return true;
  }
  /// Handles the remaining items and joins. May be called twice.
  void stop() noexcept {
    if (!thread_.joinable()) return;
    stop_.store(true, std::memory_order_release);
    filled_.signal();
    thread_.join();
  }
  [[nodiscard]] std::size_t high_water() const noexcept { return high_water_; }

 private:
  const WhenFull when_full_;
  Ring<Item, N> ring_;
  WakeEvent filled_, freed_;
  std::atomic<bool> stop_{false};
  std::size_t high_water_ = 0;
  std::thread thread_;
};

}  // namespace vergence::app
