#include "drivers/xsens/xsens.hpp"

#include "drivers/serial/serial_port.hpp"
#include "drivers/xsens/device.hpp"

namespace vergence::xsens {

std::vector<DeviceInfo> Driver::enumerate() {
  std::vector<DeviceInfo> found;
  for (const SerialPortInfo& port : list_serial_ports())
    if (port.usb_vendor != 0)
      found.push_back({"xsens", port.usb_serial, port.description, port.port});
  return found;
}

std::unique_ptr<InsDevice> Driver::open(std::string_view port, DeviceStatus* status) {
  std::string name(port);
  if (name.empty()) {
    const std::vector<DeviceInfo> ports = enumerate();
    if (ports.size() != 1) {
      *status = DeviceStatus::not_found;
      last_error_ =
          ports.empty()
              ? "there is no serial port on USB; plug the INS in, or name its port in ins.port"
              : "there is more than one serial port on USB; name the INS's in ins.port";
      return nullptr;
    }
    name = ports.front().place;
  }
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

}  // namespace vergence::xsens
