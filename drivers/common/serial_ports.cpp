#include "drivers/common/serial_ports.hpp"

#include "drivers/serial/serial_port.hpp"

namespace vergence {

std::vector<DeviceInfo> usb_serial_ports(std::string_view driver) {
  std::vector<DeviceInfo> found;
  for (const SerialPortInfo& port : list_serial_ports())
    if (port.usb_vendor != 0)
      found.push_back({std::string(driver), port.usb_serial, port.description, port.port});
  return found;
}

std::string only_usb_serial_port(std::string_view port, DeviceStatus* status, std::string* error) {
  if (!port.empty()) return std::string(port);
  const std::vector<DeviceInfo> ports = usb_serial_ports("");
  if (ports.size() == 1) return ports.front().place;
  *status = ports.empty() ? DeviceStatus::not_found : DeviceStatus::bad_configuration;
  *error = ports.empty() ? "no USB serial port is connected; connect the INS, or set ins.port"
                         : "several USB serial ports are connected; set ins.port to the INS's";
  return {};
}

}  // namespace vergence
