#pragma once
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/common/serial_ports.hpp"
#include "drivers/ins.hpp"
#include "drivers/serial/serial_port.hpp"

namespace vergence {

/// Driver for one kind of INS or satellite receiver on serial links.
///
/// A device is identified by its port (`/dev/ttyUSB0` or a link to one) instead of a serial number.
/// An empty port selects the only serial port on USB. enumerate() lists the ports on USB and sends
/// nothing to them.
template <class Device, class Options>
class SerialInsDriver final : public InsDriver {
 public:
  /// `name` is that of the row in the table of INS drivers.
  SerialInsDriver(const char* name, const Options& options) : name_(name), options_(options) {}

  [[nodiscard]] std::vector<DeviceInfo> enumerate() override { return usb_serial_ports(name_); }
  /// → the same statuses as Device::connect()
  [[nodiscard]] std::unique_ptr<InsDevice> open(std::string_view port,
                                                DeviceStatus* status) override {
    const std::string found = only_usb_serial_port(port, status, &last_error_);
    if (found.empty()) return nullptr;
    auto device = std::make_unique<Device>(std::make_unique<SerialPort>(found), options_);
    *status = device->connect();
    if (*status == DeviceStatus::ok) return device;
    last_error_ = device->last_error();
    return nullptr;
  }
  [[nodiscard]] std::string last_error() const override { return last_error_; }

 private:
  const char* name_;
  Options options_;
  std::string last_error_;
};

}  // namespace vergence
