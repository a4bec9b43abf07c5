#pragma once
#include <memory>

#include "app/config/configuration.hpp"
#include "drivers/ins.hpp"
#include "drivers/trigger_board/device.hpp"

namespace vergence::app {

/// Throws InputError if the request is wrong (unsupported, contradictory, ambiguous), or
/// DeviceError if the device is, in which case the request may succeed later.
[[noreturn]] void refuse_device(DeviceStatus status, const std::string& message);

/// Calls refuse_device() unless `ok`, with the device's title and its message or the status.
void require_configured(const std::string& title, DeviceStatus status, const std::string& error);

/// Opens and configures the INS of a configuration; null for `none`. The mock has its own.
///
/// On failure throws as refuse_device(), with the key, what was found and the fix; nothing stays
/// open. `remarks` receives messages about settings not applied as requested.
[[nodiscard]] std::unique_ptr<InsDevice> open_ins(const InsSettings& settings,
                                                  std::vector<std::string>* remarks);

/// INS in messages, such as `ins (xsens 07701234, MTI-G-710 on /dev/ttyUSB0)`.
[[nodiscard]] std::string ins_title(const DeviceInfo& info);

/// Opens and configures the trigger board, which makes no pulse until it is started.
///
/// On failure throws as refuse_device(), with the key, what was found and the fix; nothing stays
/// open. `remarks` receives messages about settings not applied as requested.
[[nodiscard]] std::unique_ptr<trigger_board::Device> open_trigger_board(
    const TriggerSettings& settings, const TriggerConfiguration& pulses,
    std::vector<std::string>* remarks);

/// Trigger board in messages, such as `trigger (board 3000…, on /dev/ttyACM0)`.
[[nodiscard]] std::string board_title(const DeviceInfo& info);

}  // namespace vergence::app
