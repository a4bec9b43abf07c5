#include "app/devices/serial_devices.hpp"

#include <fmt/format.h>

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

/// Why a device on a serial port cannot be opened. `error`: the driver's message, may be empty.
std::string serial_open_error(const std::string& who, DeviceStatus status,
                              const std::string& error) {
  switch (status) {
    case DeviceStatus::busy:
      return fmt::format(
          "{} is in use by another program; end that program (ModemManager opens new ports: "
          "vergence devices --write-udev)",
          who);
    case DeviceStatus::no_permission:
      return fmt::format(
          "{} cannot be opened: permission denied; add the user to group dialout, and log in again",
          who);
    default:
      return fmt::format("{} cannot be used: {}", who,
                         error.empty() ? std::string(to_string(status)) : error);
  }
}

/// The drivers of real INS by their name in the configuration, which the schema has checked.
std::unique_ptr<InsDriver> make_ins_driver(const InsSettings& s) {
  const auto baud = static_cast<std::uint32_t>(s.baud);
  const Duration processing = Duration::seconds(s.processing_ms * 1e-3);
  if (s.driver == "nmea") return gnss::make_driver({gnss::Protocol::nmea, baud, processing});
  if (s.driver == "ubx") return gnss::make_driver({gnss::Protocol::ubx, baud, processing});
  xsens::Options o;
  o.baud = baud;
  o.sync_out_hz = s.sync_out_hz;
  o.sync_out_width_ms = s.sync_out_width_ms;
  o.processing = processing;
  return xsens::make_driver(o);
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
  std::unique_ptr<InsDevice> device = driver->open(settings.port, &status);
  if (device == nullptr)
    refuse_device(
        status, serial_open_error(fmt::format("ins: the {} INS{}", settings.driver,
                                              settings.port.empty() ? "" : " on " + settings.port),
                                  status, driver->last_error()));
  status = device->configure(settings.rate, nullptr);
  require_configured(ins_title(device->info()), status, device->last_error());
  if (const std::string remark = device->remark(); !remark.empty())
    remarks->push_back(ins_title(device->info()) + ": " + remark);
  return device;
}

std::string board_title(const DeviceInfo& info) {
  return fmt::format("trigger ({} {}, {})", info.driver, info.serial, info.place);
}

std::unique_ptr<trigger_board::Device> open_trigger_board(const TriggerSettings& settings,
                                                          const TriggerConfiguration& pulses,
                                                          std::vector<std::string>* remarks) {
  trigger_board::Options options;
  options.baud = static_cast<std::uint32_t>(settings.baud);
  options.pps = settings.pps;
  options.ins = settings.ins;
  trigger_board::Driver driver(options);
  DeviceStatus status = DeviceStatus::ok;
  std::unique_ptr<trigger_board::Device> board = driver.open_board(settings.port, &status);
  if (board == nullptr)
    refuse_device(status,
                  serial_open_error("trigger: the trigger board" +
                                        (settings.port.empty() ? "" : " on " + settings.port),
                                    status, driver.last_error()));
  status = board->configure(pulses, nullptr);
  require_configured(board_title(board->info()), status, board->last_error());
  if (const std::string remark = board->remark(); !remark.empty())
    remarks->push_back(board_title(board->info()) + ": " + remark);
  return board;
}

}  // namespace vergence::app
