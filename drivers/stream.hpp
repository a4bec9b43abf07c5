#pragma once
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <mutex>

#include "core/memory/ring.hpp"
#include "drivers/device.hpp"

namespace vergence {

/// Stream to a device's consumer, in order of arrival.
template <class T>
struct Delivery {
  enum class What : std::uint8_t { item, gone, back, end } what = What::item;
  HostStamp arrival{};
  T value{};
};

/// Queue from the thread of a driver to the consumer of its device.
///
/// Threads  push(), full(), empty(), wait_for_room(): producer. start(), stop(): owner. take(): one
///          consumer; with limit 0 it takes no lock.
/// Full     push() refuses; the driver drops and counts, or, in virtual time, waits for room.
template <class T, std::size_t N>
class Stream {
 public:
  [[nodiscard]] bool push(const Delivery<T>& d) noexcept {
    if (!ring_.push(d)) return false;
    const std::lock_guard lock(
        mutex_);  // stop() waits for it: nobody is told after it has returned
    filled_.notify_one();
    if (notifier_ != nullptr) notifier_->notify();
    return true;
  }
  [[nodiscard]] bool full() const noexcept { return ring_.full(); }
  /// Everything pushed so far was taken.
  [[nodiscard]] bool empty() const noexcept { return ring_.empty(); }
  /// Returns when there is room, or the device is stopped.
  void wait_for_room() const noexcept {
    for (;;) {
      const std::uint32_t seen = taken_.load(std::memory_order_acquire);
      if (!full() || !streaming()) return;
      taken_.wait(seen, std::memory_order_acquire);
    }
  }
  [[nodiscard]] bool streaming() const noexcept {
    return streaming_.load(std::memory_order_acquire);
  }

  /// Starts the consumer's side. After a disconnect, `ok` only once the device is back. → ok,
  /// disconnected, ended
  [[nodiscard]] DeviceStatus start(Notifier* notifier) noexcept {
    {
      const std::lock_guard lock(mutex_);
      notifier_ = notifier;
    }
    if (ended_) return DeviceStatus::ended;
    if (gone_) {
      Delivery<T> d;
      if (!ring_.pop(&d)) return DeviceStatus::disconnected;
      if (d.what == Delivery<T>::What::end) {
        ended_ = true;
        return DeviceStatus::ended;
      }
      gone_ = false;  // nothing but `back` and `end` follows a `gone`
    }
    streaming_.store(true, std::memory_order_release);
    return DeviceStatus::ok;
  }
  void stop() noexcept {
    streaming_.store(false, std::memory_order_release);
    notify_release();  // a producer that waits for room has nobody who would make any
    {
      const std::lock_guard lock(mutex_);
      notifier_ = nullptr;
    }
    filled_.notify_all();
  }
  /// Drops what was not taken, and the disconnected state. Precondition: stopped, the producer's
  /// thread has ended, no thread is in take().
  void clear() noexcept {
    for (Delivery<T> d; ring_.pop(&d);) ended_ = ended_ || d.what == Delivery<T>::What::end;
    gone_ = false;
  }

  [[nodiscard]] DeviceStatus take(Duration limit, Delivery<T>* d) noexcept {
    if (!streaming()) return DeviceStatus::stopped;
    if (gone_) return DeviceStatus::disconnected;
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
    gone_ = d->what == Delivery<T>::What::gone;
    ended_ = d->what == Delivery<T>::What::end;
    return gone_ ? DeviceStatus::disconnected : ended_ ? DeviceStatus::ended : DeviceStatus::ok;
  }

 private:
  void notify_release() noexcept {
    taken_.fetch_add(1, std::memory_order_release);
    taken_.notify_one();
  }

  Ring<Delivery<T>, N> ring_;
  std::atomic<bool> streaming_{false};
  std::atomic<std::uint32_t> taken_{0};  // the width a futex has
  bool gone_ = false, ended_ = false;    // the consumer's
  std::mutex mutex_;
  Notifier* notifier_ = nullptr;  // under mutex_
  std::condition_variable filled_;
};

}  // namespace vergence
