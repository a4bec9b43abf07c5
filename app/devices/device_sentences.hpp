#pragma once
#include <string>

#include "drivers/device.hpp"

/// What a user is told of a device that does not open or does not do what is asked.
namespace vergence::app {

/// Why a device on a serial port cannot be opened. `who`: `ins: the xsens INS on /dev/ttyUSB0`;
/// `error`: the driver's sentence, may be empty.
[[nodiscard]] std::string serial_open_error(const std::string& who, DeviceStatus status,
                                            const std::string& error);

/// Throws: InputError where the request is at fault (a device cannot do it, it makes no sense, one
/// of several is not named), DeviceError where the device is: the same may succeed later.
[[noreturn]] void refuse_device(DeviceStatus status, const std::string& sentence);

/// refuse_device() unless `ok`: the device's title, and its sentence or the status.
void require_configured(const std::string& title, DeviceStatus status, const std::string& error);

}  // namespace vergence::app
