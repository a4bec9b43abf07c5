#include "app/commands/trigger_boards.hpp"

#include <fmt/format.h>

#include "app/runtime/errors.hpp"
#include "app/runtime/nearest.hpp"
#include "drivers/trigger_board/trigger_board.hpp"

namespace vergence::app {
namespace {

trigger_board::Edge edge_of(const std::string& key, const std::string& word) {
  if (word == "none") return trigger_board::Edge::none;
  if (word == "rising") return trigger_board::Edge::rising;
  if (word == "falling") return trigger_board::Edge::falling;
  throw InputError(fmt::format("{} is \"{}\"{}; it is one of none, rising, falling", key, word,
                               did_you_mean(word, {"none", "rising", "falling"})));
}

/// The sentence for an open() that gave nothing.
std::string refusal(const TriggerSettings& settings, const std::string& said, DeviceStatus status) {
  const std::string who =
      fmt::format("trigger: the board{}", settings.port.empty() ? "" : " on " + settings.port);
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
                         said.empty() ? std::string(to_string(status)) : said);
  }
}

}  // namespace

trigger_board::Options trigger_board_options(const TriggerSettings& settings) {
  trigger_board::Options o;
  o.baud = static_cast<std::uint32_t>(settings.baud);
  o.pps = edge_of("trigger.pps", settings.pps);
  o.ins = edge_of("trigger.ins", settings.ins);
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
  if (board == nullptr) throw InputError(refusal(settings, driver.last_error(), status));
  status = board->configure(pulses, nullptr);
  if (status != DeviceStatus::ok) {
    const std::string said = board->last_error();
    throw InputError(fmt::format(
        "{}: {}", board_title(board->info()),
        said.empty() ? fmt::format("cannot do what is asked: {}", to_string(status)) : said));
  }
  if (const std::string remark = board->remark(); !remark.empty())
    remarks->push_back(board_title(board->info()) + ": " + remark);
  return board;
}

}  // namespace vergence::app
