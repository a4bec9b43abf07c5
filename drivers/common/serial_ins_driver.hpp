#pragma once
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "drivers/common/serial_ports.hpp"
#include "drivers/ins.hpp"
#include "drivers/serial/serial_port.hpp"

namespace vergence {

/// One kind of INS or satellite receiver on serial lines.
///
/// open() takes a port (`/dev/ttyUSB0`, a link to one), not a serial number: a device is found by
/// the line it is on; empty: the only serial port on USB. enumerate() lists the ports on USB, and
/// sends nothing to them.
template <class Device, class Options>
class SerialInsDriver final : public InsDriver {
 public:
  /// `name`: of the row in the table of INS drivers.
  SerialInsDriver(const char* name, const Options& options) : name_(name), options_(options) {}

  [[nodiscard]] std::vector<DeviceInfo> enumerate() override { return usb_serial_ports(name_); }
  /// → as Device::connect()
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
