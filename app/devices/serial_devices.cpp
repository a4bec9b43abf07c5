#include "app/devices/serial_devices.hpp"

#include <fmt/format.h>

#include "app/runtime/errors.hpp"
#include "app/runtime/nearest.hpp"
#include "drivers/gnss/gnss.hpp"
#include "drivers/trigger_board/trigger_board.hpp"
#include "drivers/xsens/xsens.hpp"

namespace vergence::app {

std::string serial_open_error(const std::string& who, DeviceStatus status,
                              const std::string& error) {
  switch (status) {
    case DeviceStatus::busy:
      return fmt::format(
          "{} is in use by another program; end that one (ModemManager opens new ports: tell it "
          "not to)",
          who);
    case DeviceStatus::no_permission:
      return fmt::format(
          "{} cannot be opened without permission; add the user to group dialout, and log in again",
          who);
    default:
      return fmt::format("{} cannot be used: {}", who,
                         error.empty() ? std::string(to_string(status)) : error);
  }
}

void refuse_device(DeviceStatus status, const std::string& message) {
  switch (status) {
    case DeviceStatus::unsupported:
    case DeviceStatus::bad_configuration:
    case DeviceStatus::no_bandwidth:
      throw InputError(message);
    case DeviceStatus::ok:
    case DeviceStatus::timeout:
    case DeviceStatus::stopped:
    case DeviceStatus::ended:
    case DeviceStatus::disconnected:
    case DeviceStatus::not_found:
    case DeviceStatus::no_permission:
    case DeviceStatus::busy:
    case DeviceStatus::failed:
      break;
  }
  throw DeviceError(message);
}

void require_configured(const std::string& title, DeviceStatus status, const std::string& error) {
  if (status == DeviceStatus::ok) return;
  refuse_device(status, fmt::format("{}: {}", title,
                                    error.empty() ? fmt::format("cannot do what is asked: {}",
                                                                to_string(status))
                                                  : error));
}

namespace {

xsens::Options xsens_options(const InsRequest& request) {
  xsens::Options o;
  o.baud = request.baud;
  o.sync_out_hz = request.sync_out_hz;
  o.sync_out_width_ms = request.sync_out_width_ms;
  o.processing = Duration::seconds(request.processing_ms * 1e-3);
  return o;
}

std::unique_ptr<InsDriver> make_xsens(const InsRequest& request) {
  return xsens::make_driver(xsens_options(request));
}

template <gnss::Protocol kProtocol>
gnss::Options gnss_options(const InsRequest& request) {
  return {kProtocol, request.baud, Duration::seconds(request.processing_ms * 1e-3)};
}

template <gnss::Protocol kProtocol>
std::unique_ptr<InsDriver> make_gnss(const InsRequest& request) {
  return gnss::make_driver(gnss_options<kProtocol>(request));
}

const InsDriverRow& find_row(const InsRequest& request) {
  if (const InsDriverRow* row = find_ins_driver(request.driver)) return *row;
  const auto names = ins_driver_names();
  throw InputError(
      fmt::format("ins.driver is \"{}\"{}; supported: {}, mock (with mock cameras) and none",
                  request.driver, did_you_mean(request.driver, names), fmt::join(names, ", ")));
}

}  // namespace

const std::vector<InsDriverRow>& ins_driver_rows() {
  static const std::vector<InsDriverRow> rows{
      {"xsens", "XSens MTi-G or MTi-G-700/710 on a serial port", &make_xsens},
      {"nmea", "satellite receiver or compass that sends NMEA 0183 on a serial port",
       &make_gnss<gnss::Protocol::nmea>},
      {"ubx", "u-blox receiver that sends UBX-NAV-PVT on a serial port",
       &make_gnss<gnss::Protocol::ubx>},
  };
  return rows;
}

InsRequest ins_request(const InsSettings& s) {
  return {s.driver,       s.port,
          s.rate,         static_cast<std::uint32_t>(s.baud),
          s.sync_out_hz,  s.sync_out_width_ms,
          s.processing_ms};
}

const InsDriverRow* find_ins_driver(const std::string& name) {
  for (const InsDriverRow& row : ins_driver_rows())
    if (name == row.name) return &row;
  return nullptr;
}

std::vector<std::string> ins_driver_names() {
  std::vector<std::string> names;
  for (const InsDriverRow& row : ins_driver_rows()) names.emplace_back(row.name);
  return names;
}

std::string ins_title(const DeviceInfo& info) {
  return fmt::format("ins ({}{}{}, {} on {})", info.driver, info.serial.empty() ? "" : " ",
                     info.serial, info.model, info.place);
}

std::unique_ptr<InsDevice> open_ins(const InsRequest& request, std::vector<std::string>* remarks) {
  if (request.driver == "none") return nullptr;
  const InsDriverRow& row = find_row(request);
  const std::unique_ptr<InsDriver> driver = row.make(request);
  DeviceStatus status = DeviceStatus::ok;
  std::unique_ptr<InsDevice> device = driver->open(request.port, &status);
  if (device == nullptr)
    refuse_device(status,
                  serial_open_error(fmt::format("ins: the {} INS{}", row.name,
                                                request.port.empty() ? "" : " on " + request.port),
                                    status, driver->last_error()));
  status = device->configure(request.rate_hz, nullptr);
  require_configured(ins_title(device->info()), status, device->last_error());
  if (const std::string remark = device->remark(); !remark.empty())
    remarks->push_back(ins_title(device->info()) + ": " + remark);
  return device;
}

trigger_board::Options trigger_board_options(const TriggerSettings& settings) {
  trigger_board::Options o;
  o.baud = static_cast<std::uint32_t>(settings.baud);
  o.pps = settings.pps;
  o.ins = settings.ins;
  return o;
}

std::string board_title(const DeviceInfo& info) {
  return fmt::format("trigger ({} {}, {})", info.driver, info.serial, info.place);
}

std::unique_ptr<trigger_board::Device> open_trigger_board(const TriggerSettings& settings,
                                                          const TriggerConfiguration& pulses,
                                                          std::vector<std::string>* remarks) {
  trigger_board::Driver driver(trigger_board_options(settings));
  DeviceStatus status = DeviceStatus::ok;
  std::unique_ptr<trigger_board::Device> board = driver.open_board(settings.port, &status);
  if (board == nullptr)
    refuse_device(status,
                  serial_open_error(
                      "trigger: the board" + (settings.port.empty() ? "" : " on " + settings.port),
                      status, driver.last_error()));
  status = board->configure(pulses, nullptr);
  require_configured(board_title(board->info()), status, board->last_error());
  if (const std::string remark = board->remark(); !remark.empty())
    remarks->push_back(board_title(board->info()) + ": " + remark);
  return board;
}

}  // namespace vergence::app
