#include "app/runtime/software_trigger.hpp"

#include <pthread.h>

#include <chrono>
#include <exception>

namespace vergence::app {

using std::chrono::steady_clock;

DeviceStatus SoftwareTrigger::configure(const TriggerConfiguration& requested,
                                        TriggerConfiguration* actual) noexcept {
  if (!(requested.rate_hz > 0)) return DeviceStatus::bad_configuration;
  if (requested.rate_hz > 1000) return DeviceStatus::unsupported;
  rate_ = requested.rate_hz;
  if (actual != nullptr) *actual = requested;
  return DeviceStatus::ok;
}

DeviceStatus SoftwareTrigger::start(Notifier* ready) noexcept {
  if (!(rate_ > 0)) return DeviceStatus::bad_configuration;
  if (thread_.joinable()) return DeviceStatus::ok;
  try {
    {
      const std::lock_guard lock(mutex_);
      stop_ = false;
      ready_ = ready;
    }
    running_ = true;
    thread_ = std::thread([this] { pace(); });
  } catch (const std::exception&) {
    running_ = false;
    return DeviceStatus::failed;
  }
  ++starts_;
  return DeviceStatus::ok;
}

DeviceStatus SoftwareTrigger::wait(Duration limit, Pulse* pulse) noexcept {
  if (ring_.pop(pulse)) return DeviceStatus::ok;
  if (!running_) return DeviceStatus::stopped;
  if (limit <= Duration{}) return DeviceStatus::timeout;
  std::unique_lock lock(mutex_);
  (void)changed_.wait_for(lock, std::chrono::nanoseconds(limit.ns()),
                          [this] { return !ring_.empty() || stop_; });
  if (ring_.pop(pulse)) return DeviceStatus::ok;
  return stop_ ? DeviceStatus::stopped : DeviceStatus::timeout;
}

void SoftwareTrigger::stop() noexcept {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
    ready_ = nullptr;
  }
  running_ = false;
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
}

void SoftwareTrigger::pace() {
  (void)pthread_setname_np(pthread_self(), "vergence-pace");
  const auto period = std::chrono::nanoseconds(Duration::seconds(1 / rate_).ns());
  auto due = steady_clock::now() + period;
  for (std::uint64_t number = 0;; ++number) {
    {
      std::unique_lock lock(mutex_);
      if (changed_.wait_until(lock, due, [this] { return stop_; })) return;
    }
    Pulse pulse;
    pulse.number = number;
    pulse.arrival = HostStamp(steady_clock::now().time_since_epoch().count());
    pulse.edge = DeviceStamp(pulse.arrival.ns());
    for (CameraDevice* camera : cameras_) (void)camera->trigger_once();
    if (ring_.push(pulse))
      ++pulses_;
    else
      ++overruns_;
    {
      const std::lock_guard lock(mutex_);
      changed_.notify_all();
      if (ready_ != nullptr) ready_->notify();
    }
    due += period;
    const auto now = steady_clock::now();
    if (now > due) due = now + period;  // a camera took long to answer: no burst to catch up
  }
}

}  // namespace vergence::app
