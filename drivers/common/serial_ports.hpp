#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "drivers/device.hpp"

namespace vergence {

/// Serial ports on USB, for a driver's enumerate(). Sends nothing to them.
[[nodiscard]] std::vector<DeviceInfo> usb_serial_ports(std::string_view driver);

/// Returns `port`, or the only serial port on USB if `port` is empty. Returns an empty string if
/// there is none (*status is not_found) or more than one (bad_configuration); *error has the
/// reason.
[[nodiscard]] std::string only_usb_serial_port(std::string_view port, DeviceStatus* status,
                                               std::string* error);

}  // namespace vergence
