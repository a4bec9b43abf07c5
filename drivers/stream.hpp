#pragma once
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <mutex>

#include "core/memory/ring.hpp"
#include "drivers/device.hpp"

namespace vergence {

/// Element of the stream to a device's consumer, in order of arrival.
template <class T>
struct Delivery {
  enum class What : std::uint8_t { item, disconnected, reconnected, end } what = What::item;
  HostStamp arrival{};
  T value{};
};

/// Queue from the thread of a driver to the consumer of its device.
///
/// Threads  The producer calls push(), full(), empty() and wait_for_room(); the owner start() and
///          stop(); one consumer pop(), which takes no lock if the limit is 0.
/// Full     push() returns false. The driver then drops and counts, or, in virtual time, waits for
///          room.
template <class T, std::size_t N>
class Stream {
 public:
  [[nodiscard]] bool push(const Delivery<T>& d) noexcept {
    if (!ring_.push(d)) return false;
    // stop() also takes this mutex, so there are no notifications after it has returned.
    const std::lock_guard lock(mutex_);
    filled_.notify_one();
    if (notifier_ != nullptr) notifier_->notify();
    return true;
  }
  [[nodiscard]] bool full() const noexcept { return ring_.full(); }
  /// True if everything pushed so far was popped.
  [[nodiscard]] bool empty() const noexcept { return ring_.empty(); }
  /// Returns when there is room or the device is stopped.
  void wait_for_room() const noexcept {
    for (;;) {
      const std::uint32_t seen = popped_.load(std::memory_order_acquire);
      if (!full() || !streaming()) return;
      popped_.wait(seen, std::memory_order_acquire);
    }
  }
  [[nodiscard]] bool streaming() const noexcept {
    return streaming_.load(std::memory_order_acquire);
  }

  /// Starts the consumer's side. After a disconnect it returns `ok` only once the device has
  /// reconnected. → ok, disconnected, ended
  [[nodiscard]] DeviceStatus start(Notifier* notifier) noexcept {
    {
      const std::lock_guard lock(mutex_);
      notifier_ = notifier;
    }
    if (ended_) return DeviceStatus::ended;
    if (disconnected_) {
      Delivery<T> d;
      if (!ring_.pop(&d)) return DeviceStatus::disconnected;
      if (d.what == Delivery<T>::What::end) {
        ended_ = true;
        return DeviceStatus::ended;
      }
      // A `disconnected` is followed only by `reconnected` or `end`.
      disconnected_ = false;
    }
    streaming_.store(true, std::memory_order_release);
    return DeviceStatus::ok;
  }
  void stop() noexcept {
    streaming_.store(false, std::memory_order_release);
    // Wakes a producer that waits for room; otherwise it would wait forever.
    notify_release();
    {
      const std::lock_guard lock(mutex_);
      notifier_ = nullptr;
    }
    filled_.notify_all();
  }
  /// Drops what was not popped, and the disconnected state. Preconditions: stopped, the producer's
  /// thread has ended and no thread is in pop().
  void clear() noexcept {
    for (Delivery<T> d; ring_.pop(&d);) ended_ = ended_ || d.what == Delivery<T>::What::end;
    disconnected_ = false;
  }

  [[nodiscard]] DeviceStatus pop(Duration limit, Delivery<T>* d) noexcept {
    if (!streaming()) return DeviceStatus::stopped;
    if (disconnected_) return DeviceStatus::disconnected;
    if (ended_) return DeviceStatus::ended;
    if (!ring_.pop(d)) {
      if (limit <= Duration{}) return DeviceStatus::timeout;
      std::unique_lock lock(mutex_);
      (void)filled_.wait_for(lock, std::chrono::nanoseconds(limit.ns()),
                             [this] { return !ring_.empty() || !streaming(); });
      if (!streaming()) return DeviceStatus::stopped;
      if (!ring_.pop(d)) return DeviceStatus::timeout;
    }
    notify_release();
    disconnected_ = d->what == Delivery<T>::What::disconnected;
    ended_ = d->what == Delivery<T>::What::end;
    return disconnected_ ? DeviceStatus::disconnected
           : ended_      ? DeviceStatus::ended
                         : DeviceStatus::ok;
  }

 private:
  void notify_release() noexcept {
    popped_.fetch_add(1, std::memory_order_release);
    popped_.notify_one();
  }

  Ring<Delivery<T>, N> ring_;
  std::atomic<bool> streaming_{false};
  // Counts popped elements. Has the width of a futex, so that waiting needs no proxy.
  std::atomic<std::uint32_t> popped_{0};
  // Only the consumer uses these two flags.
  bool disconnected_ = false, ended_ = false;
  std::mutex mutex_;
  // Guarded by mutex_.
  Notifier* notifier_ = nullptr;
  std::condition_variable filled_;
};

}  // namespace vergence
