#include "app/devices/serial_devices.hpp"

#include "app/runtime/errors.hpp"
#include "drivers/gnss/gnss.hpp"
#include "drivers/trigger_board/trigger_board.hpp"
#include "drivers/xsens/xsens.hpp"

namespace vergence::app {

void refuse_device(DeviceStatus status, const std::string& message) {
  if (status == DeviceStatus::unsupported || status == DeviceStatus::bad_configuration ||
      status == DeviceStatus::no_bandwidth)
    throw InputError(message);
  throw DeviceError(message);
}

void require_configured(const std::string& title, DeviceStatus status, const std::string& error) {
  if (status == DeviceStatus::ok) return;
  refuse_device(
      status, fmt::format("{}: {}", title,
                          error.empty() ? fmt::format("cannot be configured: {}", to_string(status))
                                        : error));
}

namespace {

/// Refuses a device on a serial port that cannot be opened. `error`: the driver's message, may be
/// empty.
void require_opened(bool opened, std::string who, const std::string& port, DeviceStatus status,
                    const std::string& error) {
  if (opened) return;
  if (!port.empty()) who += " on " + port;
  refuse_device(
      status,
      who + (status == DeviceStatus::busy
                 ? " is in use by another program; end that program (ModemManager opens new ports: "
                   "vergence devices --write-udev)"
             : status == DeviceStatus::no_permission
                 ? " cannot be opened: permission denied; add the user to group dialout, and log "
                   "in again"
                 : " cannot be used: " + (error.empty() ? std::string(to_string(status)) : error)));
}

/// Requires that a device was configured, and passes on what was not applied as requested.
template <class Device>
void require_configured(const std::string& title, const Device& device, DeviceStatus status,
                        std::vector<std::string>* remarks) {
  app::require_configured(title, status, device.last_error());
  if (const std::string remark = device.remark(); !remark.empty())
    remarks->push_back(title + ": " + remark);
}

/// The drivers of real INS by their name in the configuration, which the schema has checked.
std::unique_ptr<InsDriver> make_ins_driver(const InsSettings& s) {
  const auto baud = static_cast<std::uint32_t>(s.baud);
  const Duration processing = Duration::seconds(s.processing_ms * 1e-3);
  if (s.driver == "nmea") return gnss::make_driver({gnss::Protocol::nmea, baud, processing});
  if (s.driver == "ubx") return gnss::make_driver({gnss::Protocol::ubx, baud, processing});
  return xsens::make_driver({.baud = baud,
                             .sync_out_hz = s.sync_out_hz,
                             .sync_out_width_ms = s.sync_out_width_ms,
                             .processing = processing});
}

}  // namespace

std::string ins_title(const DeviceInfo& info) {
  return fmt::format("ins ({}{}{}, {} on {})", info.driver, info.serial.empty() ? "" : " ",
                     info.serial, info.model, info.place);
}

std::unique_ptr<InsDevice> open_ins(const InsSettings& settings,
                                    std::vector<std::string>* remarks) {
  if (settings.driver == "none") return nullptr;
  const std::unique_ptr<InsDriver> driver = make_ins_driver(settings);
  DeviceStatus status = DeviceStatus::ok;
  auto device = driver->open(settings.port, &status);
  require_opened(device != nullptr, fmt::format("ins: the {} INS", settings.driver), settings.port,
                 status, driver->last_error());
  require_configured(ins_title(device->info()), *device, device->configure(settings.rate, nullptr),
                     remarks);
  return device;
}

std::string board_title(const DeviceInfo& info) {
  return fmt::format("trigger ({} {}, {})", info.driver, info.serial, info.place);
}

std::unique_ptr<trigger_board::Device> open_trigger_board(const TriggerSettings& settings,
                                                          const TriggerConfiguration& pulses,
                                                          std::vector<std::string>* remarks) {
  trigger_board::Driver driver({.baud = static_cast<std::uint32_t>(settings.baud),
                                .pps = settings.pps,
                                .ins = settings.ins});
  DeviceStatus status = DeviceStatus::ok;
  auto board = driver.open_board(settings.port, &status);
  require_opened(board != nullptr, "trigger: the trigger board", settings.port, status,
                 driver.last_error());
  require_configured(board_title(board->info()), *board, board->configure(pulses, nullptr),
                     remarks);
  return board;
}

}  // namespace vergence::app
