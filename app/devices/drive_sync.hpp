#pragma once
#include <cstdint>
#include <vector>

#include "app/config/configuration.hpp"
#include "drivers/sync/sync_types.hpp"
#include "drivers/trigger.hpp"

/// From the configuration to how pulses are made and images paired. All of it throws InputError
/// naming the key and what to do.
namespace vergence::app {

/// How the images are paired. Checks that the devices of the configuration can do what `sync.mode`
/// needs.
[[nodiscard]] SyncOptions sync_options(const Configuration& configuration, int cameras);

/// What real devices say beyond the configuration. `trigger`: pulses are started by us.
void fit_to_devices(const Configuration& configuration, const std::vector<DeviceTiming>& cameras,
                    bool trigger, SyncOptions* options);

/// The INS can make pulses of trigger.rate, and tells of each.
void check_sync_out(const Configuration& configuration, const DeviceInfo& ins);

/// What the board is asked for.
[[nodiscard]] TriggerConfiguration trigger_configuration(const Configuration& configuration,
                                                         int cameras);

/// What proves the pairing, or that nothing does: for events and reports.
[[nodiscard]] const char* proof_sentence(SyncMode mode) noexcept;

}  // namespace vergence::app
