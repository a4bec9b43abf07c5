#pragma once
#include <pthread.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <memory>
#include <mutex>
#include <thread>
#include <utility>

#include "drivers/serial/serial_link.hpp"
#include "drivers/stream.hpp"

namespace vergence {

/// Base of devices on a serial link. It has the link and its factory, the thread that reads it, the
/// ring to the consumer and the reopening after a disconnect. A driver derives from it and
/// implements its protocol.
///
/// States     The thread calls begin() until the device streams, then read_on(). On any status but
///            `stopped` and `ended` it reports `disconnected` once and reopens every
///            kReopenInterval until begin() succeeds. A `back` precedes the next reading.
/// Ownership  The derived class calls stop_thread() in its destructor, because the hooks are its
///            members.
/// Threads    Functions of the owner's thread are marked below. The hooks run on the device's
///            thread, which owns line() from start_thread() to stop_thread().
/// Memory     The thread allocates only while the device is disconnected or being configured.
/// Errors     The thread does not throw; an exception in reopen() is a failed attempt.
template <class Value, std::size_t kRing>
class SerialDevice {
 public:
  SerialDevice(const SerialDevice&) = delete;
  SerialDevice& operator=(const SerialDevice&) = delete;

 protected:
  using Item = Delivery<Value>;
  static constexpr Duration kReopenInterval = Duration::milliseconds(500);

  SerialDevice(std::unique_ptr<SerialLinkFactory> place, const char* thread_name)
      : place_(std::move(place)), thread_name_(thread_name) {}
  virtual ~SerialDevice() = default;

  // Hooks, called on the device's thread.

  /// Makes the device behind line() stream. → ok, stopped, ended; anything else counts as
  /// disconnected
  [[nodiscard]] virtual DeviceStatus begin() noexcept = 0;
  /// Reads and hands out until interrupted. → ok (begin again), stopped, ended; anything else
  /// counts as disconnected
  [[nodiscard]] virtual DeviceStatus read_on() noexcept = 0;
  /// Opens the link and finds the device again. → ok, or the attempt failed
  [[nodiscard]] virtual DeviceStatus reopen() = 0;
  /// Called after begin() or read_on() returned this status, unless it was `stopped`.
  virtual void interrupted(DeviceStatus /*status*/) noexcept {}
  /// Last call of the thread.
  virtual void finished() noexcept {}

  // Functions of the owner's thread.

  [[nodiscard]] SerialLinkFactory& place() const noexcept { return *place_; }
  /// Null if not open. Belongs to the device's thread while it runs, else to the owner's.
  [[nodiscard]] SerialLink* line() const noexcept { return line_.get(); }
  [[nodiscard]] DeviceStatus open_line(const LineSettings& settings) {
    DeviceStatus status = DeviceStatus::ok;
    auto line = place_->open(settings, &status);
    const std::lock_guard lock(line_mutex_);
    line_ = std::move(line);
    return status;
  }
  void close_line() noexcept {
    std::unique_ptr<SerialLink> line;
    const std::lock_guard lock(line_mutex_);
    line = std::move(line_);
  }
  /// Queries once, when the device is opened, whether the link runs in virtual time.
  void query_virtual_time() { virtual_time_ = place_->pass(Duration{}); }
  [[nodiscard]] bool virtual_time() const noexcept { return virtual_time_; }

  /// Same contract as CameraDevice::start(). A thread that already runs continues, whether the
  /// device streams, is disconnected or has reconnected.
  [[nodiscard]] DeviceStatus start_thread(Notifier* ready) noexcept {
    if (thread_.joinable()) return out_.start(ready);
    // Readings of the previous start are outdated.
    out_.clear();
    const DeviceStatus status = out_.start(ready);
    if (status != DeviceStatus::ok) return status;
    try {
      stopping_.store(false, std::memory_order_release);
      reported_disconnect_ = false;
      away_.store(false, std::memory_order_relaxed);
      thread_ = std::thread([this] { work(); });
    } catch (const std::exception&) {
      out_.stop();
      return DeviceStatus::failed;
    }
    starts_.fetch_add(1, std::memory_order_relaxed);
    return DeviceStatus::ok;
  }
  void stop_thread() noexcept {
    if (!thread_.joinable()) return out_.stop();
    {
      const std::scoped_lock lock(pause_mutex_, line_mutex_);
      stopping_.store(true, std::memory_order_release);
      if (line_ != nullptr) line_->wake();
    }
    stopped_.notify_all();
    out_.stop();
    thread_.join();
    away_.store(false, std::memory_order_relaxed);
    stopping_.store(false, std::memory_order_release);
  }
  [[nodiscard]] bool running() const noexcept { return thread_.joinable(); }

  // Functions of any thread.

  [[nodiscard]] const std::atomic<bool>& stopping() const noexcept { return stopping_; }
  [[nodiscard]] bool stop_requested() const noexcept {
    return stopping_.load(std::memory_order_acquire);
  }
  [[nodiscard]] bool streaming() const noexcept { return out_.streaming(); }
  /// True from a disconnect until the device has reconnected.
  [[nodiscard]] bool away() const noexcept { return away_.load(std::memory_order_acquire); }
  [[nodiscard]] std::uint64_t overruns() const noexcept {
    return overruns_.load(std::memory_order_relaxed);
  }
  [[nodiscard]] std::uint64_t starts() const noexcept {
    return starts_.load(std::memory_order_relaxed);
  }

  /// Called on the consumer's thread. With `disconnected`, value->arrival is set.
  [[nodiscard]] DeviceStatus pop(Duration limit, Value* value) noexcept {
    Item item;
    const DeviceStatus status = out_.pop(limit, &item);
    if (status == DeviceStatus::disconnected) value->arrival = item.arrival;
    if (status == DeviceStatus::ok) *value = item.value;
    return status;
  }

  // Functions of the device's thread.

  /// Hands out a reading. If the ring is full, the reading is dropped and counted; in virtual time
  /// the call waits instead.
  void hand_out(const Value& value, HostStamp arrival) noexcept {
    push({Item::What::item, arrival, value}, virtual_time_);
  }
  /// Reports that the device streams. Called after begin(); a driver that hands out readings during
  /// begin() calls it first.
  void report_streaming(HostStamp now) noexcept {
    away_.store(false, std::memory_order_release);
    if (std::exchange(reported_disconnect_, false)) push({Item::What::reconnected, now, {}}, true);
  }

 private:
  void work() noexcept {
    (void)pthread_setname_np(pthread_self(), thread_name_);
    while (!stop_requested()) {
      DeviceStatus status = line_ != nullptr ? begin() : DeviceStatus::disconnected;
      HostStamp when = line_ != nullptr ? line_->now() : HostStamp{};
      const bool refused = line_ != nullptr && status != DeviceStatus::ok;
      if (status == DeviceStatus::ok) {
        report_streaming(when);
        status = read_on();
        if (line_ != nullptr) when = line_->now();
      }
      if (status == DeviceStatus::stopped) break;
      interrupted(status);
      if (status == DeviceStatus::ok) continue;
      if (status == DeviceStatus::ended) {
        push({Item::What::end, when, {}}, true);
        break;
      }
      away_.store(true, std::memory_order_release);
      if (!std::exchange(reported_disconnect_, true))
        push({Item::What::disconnected, when, {}}, true);
      close_line();
      // The link opened, but begin() failed: without a pause the device would be retried
      // continuously.
      if (refused) rest(kReopenInterval);
      if (!come_back()) break;
    }
    finished();
  }

  /// Reopens the device until it succeeds. Returns false if stopped.
  [[nodiscard]] bool come_back() noexcept {
    while (!stop_requested()) {
      try {
        if (reopen() == DeviceStatus::ok) return true;
        // Out of memory; the next attempt may succeed.
      } catch (const std::exception&) {
      }
      close_line();
      rest(kReopenInterval);
    }
    return false;
  }

  void rest(Duration time) noexcept {
    if (place_->pass(time)) return;
    std::unique_lock lock(pause_mutex_);
    (void)stopped_.wait_for(lock, std::chrono::nanoseconds(time.ns()),
                            [this] { return stop_requested(); });
  }

  void push(const Item& item, bool waits) noexcept {
    while (!out_.push(item)) {
      if (!waits) {
        overruns_.fetch_add(1, std::memory_order_relaxed);
        return;
      }
      out_.wait_for_room();
      if (stop_requested()) return;
    }
  }

  std::unique_ptr<SerialLinkFactory> place_;
  const char* const thread_name_;
  bool virtual_time_ = false;
  // Guards the pointer line_, because stop_thread() wakes a link that may be replaced.
  std::mutex line_mutex_;
  std::unique_ptr<SerialLink> line_;
  Stream<Value, kRing> out_;
  std::atomic<bool> stopping_{false}, away_{false};
  bool reported_disconnect_ = false;
  std::mutex pause_mutex_;
  std::condition_variable stopped_;
  std::thread thread_;
  std::atomic<std::uint64_t> overruns_{0}, starts_{0};
};

}  // namespace vergence
