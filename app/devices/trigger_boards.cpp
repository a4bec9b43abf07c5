#include "app/devices/trigger_boards.hpp"

#include <fmt/format.h>

#include "app/devices/device_sentences.hpp"
#include "app/runtime/errors.hpp"
#include "drivers/trigger_board/trigger_board.hpp"

namespace vergence::app {
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
