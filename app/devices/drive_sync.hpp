#pragma once
#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <thread>
#include <vector>

#include "app/config/configuration.hpp"
#include "core/memory/ring.hpp"
#include "drivers/camera.hpp"
#include "drivers/sync/sync_types.hpp"
#include "drivers/trigger.hpp"

/// From the configuration to how pulses are made and images paired. All of it throws InputError
/// naming the key and what to do.
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

/// Returns the pairing options. Checks that the devices of the configuration can do what
/// `sync.mode` needs.
[[nodiscard]] SyncOptions sync_options(const Configuration& configuration, int cameras);

/// Adapts the options to the properties of real devices. `trigger`: pulses are started by us.
void fit_to_devices(const Configuration& configuration, const std::vector<DeviceTiming>& cameras,
                    bool trigger, SyncOptions* options);

/// The INS can make pulses of trigger.rate, and tells of each.
void check_sync_out(const Configuration& configuration, const DeviceInfo& ins);

/// Requested configuration of the trigger board.
[[nodiscard]] TriggerConfiguration trigger_configuration(const Configuration& configuration,
                                                         int cameras);

/// Describes how the pairing is verified, for events and reports.
[[nodiscard]] const char* proof_message(SyncMode mode) noexcept;

}  // namespace vergence::app
