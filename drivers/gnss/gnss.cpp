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
  return open_on(std::make_unique<SerialPort>(name), options_, status, &last_error_);
}

std::unique_ptr<InsDevice> open_on(std::unique_ptr<LinePlace> place, const Options& options,
                                   DeviceStatus* status, std::string* error) {
  auto device = std::make_unique<Device>(std::move(place), options);
  *status = device->connect();
  if (*status == DeviceStatus::ok) return device;
  *error = device->last_error();
  return nullptr;
}

}  // namespace vergence::gnss
