#pragma once
#include <memory>
#include <string>
#include <vector>

#include "app/config/configuration.hpp"
#include "drivers/device.hpp"
#include "drivers/ins.hpp"
#include "drivers/serial/serial_link.hpp"
#include "drivers/trigger_board/device.hpp"
#include "drivers/xsens/options.hpp"

namespace vergence::app {

/// Throws: InputError where the request is at fault (a device cannot do it, it makes no sense, one
/// of several is not named), DeviceError where the device is: the same may succeed later.
[[noreturn]] void refuse_device(DeviceStatus status, const std::string& message);

/// refuse_device() unless `ok`: the device's title, and its message or the status.
void require_configured(const std::string& title, DeviceStatus status, const std::string& error);

/// Opens and configures the INS of a configuration; null for `none`. The mock's comes from its rig.
///
/// Errors  As refuse_device(), one message: the key, what was found, what to do. Nothing
///         stays open then.
/// `remarks`: messages about what works, but not as asked.
[[nodiscard]] std::unique_ptr<InsDevice> open_ins(const InsSettings& settings,
                                                  std::vector<std::string>* remarks);

/// An INS for a message: `ins (xsens 07701234, MTI-G-710 on /dev/ttyUSB0)`.
[[nodiscard]] std::string ins_title(const DeviceInfo& info);

/// Opens the trigger board and configures it; from then on it makes no pulse until it is started.
///
/// Errors  As refuse_device(), one message: the key, what was found, what to do. Nothing
///         stays open then.
/// `remarks`: messages about what works, but not as asked.
[[nodiscard]] std::unique_ptr<trigger_board::Device> open_trigger_board(
    const TriggerSettings& settings, const TriggerConfiguration& pulses,
    std::vector<std::string>* remarks);

/// A board for a message: `trigger (board 3000…, on /dev/ttyACM0)`.
[[nodiscard]] std::string board_title(const DeviceInfo& info);

}  // namespace vergence::app
