#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "drivers/device.hpp"

namespace vergence {

/// Serial ports on USB, for a driver's enumerate(). Nothing is sent to them.
[[nodiscard]] std::vector<DeviceInfo> usb_serial_ports(std::string_view driver);

/// `port`, or, where it is empty, the only serial port on USB. Empty: there is none (*status
/// not_found) or more than one (bad_configuration), *error says which.
[[nodiscard]] std::string only_usb_serial_port(std::string_view port, DeviceStatus* status,
                                               std::string* error);

}  // namespace vergence
