#pragma once
#include <atomic>
#include <cmath>
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

/// Configuration of pulses and pairing. All functions throw InputError with the key and the fix.
namespace vergence::app {

/// Trigger by software: commands an exposure of every camera, one after the other, at the rate.
///
/// The exposures differ by the duration of a command, as their stamps show. Disconnected cameras
/// are skipped. The cameras must outlive it and be started first. Runs an own thread between
/// start() and stop(). start() returns `failed` without a thread.
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
  // Guarded by mutex_. True unless the thread runs.
  bool stop_ = true;
  // Guarded by mutex_.
  Notifier* ready_ = nullptr;
  Ring<Pulse, 64> ring_;
  std::atomic<std::uint64_t> pulses_{0}, overruns_{0}, starts_{0};
  std::thread thread_;
};

/// To the nearest nanosecond.
[[nodiscard]] inline Duration microseconds(double us) {
  return Duration::nanoseconds(std::llround(us * 1e3));
}

/// Returns the pairing options. Checks that the configured devices support `sync.mode`.
[[nodiscard]] SyncOptions sync_options(const Configuration& configuration, int cameras);

/// Adapts the options to the properties of real devices. `trigger` is set if this program starts
/// the pulses.
void fit_to_devices(const Configuration& configuration, const std::vector<DeviceTiming>& cameras,
                    bool trigger, SyncOptions* options);

/// Checks that the INS can make pulses at trigger.rate and reports each.
void check_sync_out(const Configuration& configuration, const DeviceInfo& ins);

/// Requested configuration of the trigger board.
[[nodiscard]] TriggerConfiguration trigger_configuration(const Configuration& configuration,
                                                         int cameras);

/// Describes how the pairing is verified, for events and reports.
[[nodiscard]] const char* proof_message(SyncMode mode) noexcept;

}  // namespace vergence::app
