#pragma once
#include <cmath>
#include <memory>

#include "app/config/configuration.hpp"
#include "drivers/trigger.hpp"

/// Configuration of pulses and pairing. All functions throw InputError with the key and the fix.
namespace vergence::app {

/// Trigger by software: commands an exposure of every camera, one after the other, at the rate.
///
/// The exposures differ by the duration of a command, as their stamps show. Disconnected cameras
/// are skipped. The cameras must outlive it and be started first. Runs an own thread between
/// start() and stop(). start() returns `failed` without a thread.
[[nodiscard]] std::unique_ptr<TriggerDevice> make_software_trigger(
    std::vector<CameraDevice*> cameras);

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
