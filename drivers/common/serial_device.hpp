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

/// Base of devices on a serial link: the link and its factory, the thread that reads
/// it, the ring to the consumer, and the reopening after the device was gone. A driver derives from
/// it and fills in what its protocol does.
///
/// States     The thread begins (begin(): the device streams), reads (read_on()), and on anything
///            but `stopped` and `ended` reports `disconnected` once and reopens every
///            kReopenInterval until the device is back, also where it opens but does not begin;
///            `back` precedes its next reading.
/// Ownership  The derived class calls stop_thread() in its destructor: the hooks are its own.
/// Threads    Owner's thread: the protected functions named so. The hooks run on the device's
///            thread, which owns line() from start_thread() to stop_thread().
/// Memory     The thread allocates only while the device is gone or being set up.
/// Errors     Nothing throws out of the thread; an exception in reopen() is a failed attempt.
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

  // ---- hooks, on the device's thread

  /// Puts the device behind line() into streaming. → ok, stopped, ended; anything else:
  /// disconnected
  [[nodiscard]] virtual DeviceStatus begin() noexcept = 0;
  /// Reads and hands out. → ok (begin again), stopped, ended; anything else: disconnected
  [[nodiscard]] virtual DeviceStatus read_on() noexcept = 0;
  /// Opens the line and finds the device again. → ok, or the attempt failed
  [[nodiscard]] virtual DeviceStatus reopen() = 0;
  /// begin() or read_on() returned this, and it was not `stopped`.
  virtual void interrupted(DeviceStatus /*status*/) noexcept {}
  /// The thread's last call.
  virtual void finished() noexcept {}

  // ---- owner's thread

  [[nodiscard]] SerialLinkFactory& place() const noexcept { return *place_; }
  /// Null: not open. Owner's thread while there is no other, else the device's.
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
  /// Asked once, when the device is opened.
  void query_virtual_time() { virtual_time_ = place_->pass(Duration{}); }
  [[nodiscard]] bool virtual_time() const noexcept { return virtual_time_; }

  /// As CameraDevice::start(). The thread runs on when it is there already: streaming, or gone and
  /// perhaps back.
  [[nodiscard]] DeviceStatus start_thread(Notifier* ready) noexcept {
    if (thread_.joinable()) return out_.start(ready);
    out_.clear();  // of the start before: its readings are past
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

  // ---- any thread

  [[nodiscard]] const std::atomic<bool>& stopping() const noexcept { return stopping_; }
  [[nodiscard]] bool stop_requested() const noexcept {
    return stopping_.load(std::memory_order_acquire);
  }
  [[nodiscard]] bool streaming() const noexcept { return out_.streaming(); }
  /// Gone, and not back yet.
  [[nodiscard]] bool away() const noexcept { return away_.load(std::memory_order_acquire); }
  [[nodiscard]] std::uint64_t overruns() const noexcept {
    return overruns_.load(std::memory_order_relaxed);
  }
  [[nodiscard]] std::uint64_t starts() const noexcept {
    return starts_.load(std::memory_order_relaxed);
  }

  /// Consumer's thread. `disconnected`: *value has its `arrival` set.
  [[nodiscard]] DeviceStatus take(Duration limit, Value* value) noexcept {
    Item item;
    const DeviceStatus status = out_.take(limit, &item);
    if (status == DeviceStatus::disconnected) value->arrival = item.arrival;
    if (status == DeviceStatus::ok) *value = item.value;
    return status;
  }

  // ---- the device's thread

  /// A reading; dropped and counted when the ring is full, but for virtual time, which waits.
  void hand_out(const Value& value, HostStamp arrival) noexcept {
    push({Item::What::item, arrival, value}, virtual_time_);
  }
  /// The device streams. Called after begin(); a driver that hands out while it begins calls it
  /// itself before that.
  void report_streaming(HostStamp now) noexcept {
    away_.store(false, std::memory_order_release);
    if (std::exchange(reported_disconnect_, false)) push({Item::What::back, now, {}}, true);
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
      if (!std::exchange(reported_disconnect_, true)) push({Item::What::gone, when, {}}, true);
      close_line();
      // It opens well and answers at once: without a pause it would be asked as fast as it answers.
      if (refused) rest(kReopenInterval);
      if (!come_back()) break;
    }
    finished();
  }

  /// False: stopped.
  [[nodiscard]] bool come_back() noexcept {
    while (!stop_requested()) {
      try {
        if (reopen() == DeviceStatus::ok) return true;
      } catch (const std::exception&) {  // out of memory: perhaps not the next time
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
  std::mutex line_mutex_;  // of the pointer: stop_thread() wakes a line that may be replaced
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
