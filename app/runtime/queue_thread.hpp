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

/// Policy for the newest item when a queue is full: its producer waits (replay, virtual time), or
/// it is dropped (live).
enum class WhenFull : std::uint8_t { wait, drop };

/// A bounded queue and the thread that takes from it, for producers that must never wait for a
/// disk.
///
/// Threads  start(), stop(): the owner's, stop() after the last post(). post(), high_water(): one
///          producer.
/// Memory   Fixed; post() takes none.
/// Errors   start() throws std::system_error when no thread can be had.
template <class Item, std::size_t N>
class QueueThread {
 public:
  explicit QueueThread(WhenFull when_full) noexcept : when_full_(when_full) {}
  ~QueueThread() { stop(); }
  QueueThread(const QueueThread&) = delete;
  QueueThread& operator=(const QueueThread&) = delete;

  /// `begin` is called first on the thread; `handle` with every item in order, and with null
  /// whenever none waits.
  template <class Begin, class Handle>
  void start(const char* name, Begin begin, Handle handle) {
    thread_ = std::thread([this, name, begin = std::move(begin), handle = std::move(handle)] {
      (void)pthread_setname_np(pthread_self(), name);
      begin();
      for (Item item;;) {
        const WakeEvent::Ticket seen = filled_.ticket();
        // Before the ring: what was posted before stop() is still found.
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

  /// False: it was dropped. Where items are dropped, `spare` places stay free for others.
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
  /// Handles what waits and joins. Twice is harmless.
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
