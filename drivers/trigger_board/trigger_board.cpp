#include "drivers/trigger_board/trigger_board.hpp"

#include <utility>

namespace vergence::trigger_board {
namespace {

/// XSens' own converters, which connect an INS.
bool of_xsens(const SerialPortInfo& port) noexcept {
  constexpr std::uint16_t kFtdi = 0x0403, kXsens = 0x2639;
  return port.usb_vendor == kXsens ||
         (port.usb_vendor == kFtdi && port.usb_product >= 0xD388 && port.usb_product <= 0xD38F);
}

}  // namespace

Driver::Driver(const Options& options)
    : Driver(options, {list_serial_ports, [](const std::string& port) {
                         return std::make_unique<SerialPort>(port);
                       }}) {}

std::vector<std::string> Driver::candidates() const {
  std::vector<std::string> found;
  for (const SerialPortInfo& port : ports_.list())
    if (port.usb_vendor != 0 && !of_xsens(port)) found.push_back(port.port);
  return found;
}

std::unique_ptr<Device> Driver::open_port(const std::string& port, DeviceStatus* status) {
  Options options = options_;
  options.native_usb = options.native_usb || is_native_usb(port);
  auto device = std::make_unique<Device>(ports_.at(port), options);
  *status = device->connect();
  if (*status == DeviceStatus::ok) return device;
  last_error_ = device->last_error();
  return nullptr;
}

std::vector<DeviceInfo> Driver::enumerate() {
  std::vector<DeviceInfo> found;
  for (const std::string& port : candidates()) {
    DeviceStatus status = DeviceStatus::ok;
    if (const auto board = open_port(port, &status)) found.push_back(board->info());
  }
  return found;
}

std::unique_ptr<Device> Driver::find_board(std::string_view serial, DeviceStatus* status) {
  std::unique_ptr<Device> chosen;
  std::string others;
  DeviceStatus worst_status = DeviceStatus::not_found;
  for (const std::string& port : candidates()) {
    std::unique_ptr<Device> board = open_port(port, status);
    if (board == nullptr) {
      // A trigger board that cannot be used matters more than a port without one.
      if (*status != DeviceStatus::not_found && *status != DeviceStatus::disconnected)
        worst_status = *status, others = last_error_;
      continue;
    }
    if (!serial.empty() && board->info().serial != serial) continue;
    if (chosen != nullptr) {
      last_error_ =
          "several trigger boards are connected; set trigger.port to the port or serial number of "
          "one";
      *status = DeviceStatus::bad_configuration;
      return nullptr;
    }
    chosen = std::move(board);
  }
  *status = chosen != nullptr ? DeviceStatus::ok : worst_status;
  last_error_ = chosen != nullptr ? ""
                : !others.empty() ? others
                : serial.empty()
                    ? "no trigger board responds on any USB port; connect it, or set trigger.port"
                    : "no trigger board with serial number " + std::string(serial) +
                          " responds; check trigger.port and its cable";
  return chosen;
}

std::unique_ptr<Device> Driver::open_board(std::string_view where, DeviceStatus* status) {
  last_error_.clear();
  return where.find('/') != std::string_view::npos ? open_port(std::string(where), status)
                                                   : find_board(where, status);
}

std::unique_ptr<TriggerDevice> Driver::open(std::string_view where, DeviceStatus* status) {
  return open_board(where, status);
}

}  // namespace vergence::trigger_board
