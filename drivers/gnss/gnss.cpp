#include "drivers/gnss/gnss.hpp"

#include <utility>

#include "drivers/common/serial_ports.hpp"
#include "drivers/gnss/device.hpp"
#include "drivers/serial/serial_port.hpp"

namespace vergence::gnss {

std::vector<DeviceInfo> Driver::enumerate() {
  return usb_serial_ports(options_.protocol == Protocol::nmea ? "nmea" : "ubx");
}

std::unique_ptr<InsDevice> Driver::open(std::string_view port, DeviceStatus* status) {
  const std::string name = only_usb_serial_port(port, status, &last_error_);
  if (name.empty()) return nullptr;
  auto device = std::make_unique<Device>(std::make_unique<SerialPort>(name), options_);
  *status = device->connect();
  if (*status == DeviceStatus::ok) return device;
  last_error_ = device->last_error();
  return nullptr;
}

}  // namespace vergence::gnss
