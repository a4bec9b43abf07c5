#pragma once
#include <atomic>
#include <condition_variable>
#include <mutex>
#include <thread>
#include <vector>

#include "core/memory/ring.hpp"
#include "drivers/camera.hpp"
#include "drivers/trigger.hpp"

namespace vergence::app {

/// A trigger board made of software: asks every camera for an exposure at the rate, one after the
/// other.
///
/// The cameras expose as far apart as a command takes; their stamps tell. A camera that is gone is
/// passed over.
/// Ownership  The cameras outlive it and are started before it. Threads: one of its own between
///            start() and stop().
/// Errors     start(): failed, when no thread can be had.
class SoftwareTrigger final : public TriggerDevice {
 public:
  explicit SoftwareTrigger(std::vector<CameraDevice*> cameras) : cameras_(std::move(cameras)) {}
  ~SoftwareTrigger() override { stop(); }

  const DeviceInfo& info() const noexcept override { return info_; }
  DeviceStatus configure(const TriggerConfiguration& requested,
                         TriggerConfiguration* actual) noexcept override;
  DeviceStatus start(Notifier* ready) noexcept override;
  DeviceStatus wait(Duration limit, Pulse* pulse) noexcept override;
  void stop() noexcept override;
  TriggerStatistics statistics() const noexcept override {
    TriggerStatistics s;
    s.pulses = pulses_.load();
    s.overruns = overruns_.load();
    s.starts = starts_.load();
    return s;
  }

 private:
  void pace();

  DeviceInfo info_{"software", "", "commands over the cameras' own links", ""};
  std::vector<CameraDevice*> cameras_;
  double rate_ = 0;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool stop_ = false;          // under mutex_
  Notifier* ready_ = nullptr;  // under mutex_
  Ring<Pulse, 64> ring_;
  std::atomic<bool> running_{false};
  std::atomic<std::uint64_t> pulses_{0}, overruns_{0}, starts_{0};
  std::thread thread_;
};

}  // namespace vergence::app
