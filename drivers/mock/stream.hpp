#pragma once
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <mutex>

#include "core/memory/ring.hpp"
#include "drivers/device.hpp"

namespace vergence::mock {

/// What reaches a device's consumer, in the order of arrival.
template <class T>
struct Delivery {
  enum class What : std::uint8_t { item, gone, back, end } what = What::item;
  HostStamp arrival{};
  T value{};
};

/// From the mock's producer to the consumer of one device.
///
/// Threads  push(), full(): producer. start(), stop(): owner. take(): one consumer; with limit 0 it takes no lock.
template <class T, std::size_t N>
class Stream {
 public:
  [[nodiscard]] bool push(const Delivery<T>& d) noexcept {
    if (!ring_.push(d)) return false;
    const std::lock_guard lock(mutex_);  // stop() waits for it: nobody is told after it has returned
    filled_.notify_one();
    if (notifier_ != nullptr) notifier_->notify();
    return true;
  }
  [[nodiscard]] bool full() const noexcept { return ring_.full(); }
  [[nodiscard]] bool streaming() const noexcept { return streaming_.load(std::memory_order_acquire); }

  /// While gone: whether it has come back.
  [[nodiscard]] DeviceStatus start(Notifier* notifier) noexcept {
    {
      const std::lock_guard lock(mutex_);
      notifier_ = notifier;
    }
    if (ended_) return DeviceStatus::ended;
    if (gone_) {
      Delivery<T> d;
      if (!ring_.pop(&d)) return DeviceStatus::gone;
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
    {
      const std::lock_guard lock(mutex_);
      notifier_ = nullptr;
    }
    filled_.notify_all();
  }

  [[nodiscard]] DeviceStatus take(Duration limit, Delivery<T>* d) noexcept {
    if (!streaming()) return DeviceStatus::stopped;
    if (gone_) return DeviceStatus::gone;
    if (ended_) return DeviceStatus::ended;
    if (!ring_.pop(d)) {
      if (limit <= Duration{}) return DeviceStatus::timeout;
      std::unique_lock lock(mutex_);
      (void)filled_.wait_for(lock, std::chrono::nanoseconds(limit.ns()), [this] { return !ring_.empty() || !streaming(); });
      if (!streaming()) return DeviceStatus::stopped;
      if (!ring_.pop(d)) return DeviceStatus::timeout;
    }
    gone_ = d->what == Delivery<T>::What::gone;
    ended_ = d->what == Delivery<T>::What::end;
    return gone_ ? DeviceStatus::gone : ended_ ? DeviceStatus::ended : DeviceStatus::ok;
  }

 private:
  Ring<Delivery<T>, N> ring_;
  std::atomic<bool> streaming_{false};
  bool gone_ = false, ended_ = false;  // the consumer's
  std::mutex mutex_;
  Notifier* notifier_ = nullptr;  // under mutex_
  std::condition_variable filled_;
};

}  // namespace vergence::mock
