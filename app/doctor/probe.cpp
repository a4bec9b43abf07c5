#include "app/doctor/probe.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "app/devices/ins_drivers.hpp"
#include "drivers/trigger_board/trigger_board.hpp"

namespace vergence::app {

std::vector<Asker> all_askers() {
  std::vector<Asker> askers;
  for (const InsDriverRow& row : ins_driver_rows())
    askers.push_back(
        {"ins", row.name, [make = row.make](const std::string& port) -> std::optional<DeviceInfo> {
           DeviceStatus status = DeviceStatus::ok;
           const auto device = make(InsRequest{})->open(port, &status);
           return device == nullptr ? std::nullopt : std::optional(device->info());
         }});
  askers.push_back({"trigger", "board", [](const std::string& port) -> std::optional<DeviceInfo> {
                      DeviceStatus status = DeviceStatus::ok;
                      const auto device = trigger_board::Driver().open(port, &status);
                      return device == nullptr ? std::nullopt : std::optional(device->info());
                    }});
  return askers;
}

void probe(FoundPort* port, const std::vector<Asker>& askers) {
  if (port->kind == SerialKind::built_in) return;
  const bool ins_first = port->kind == SerialKind::ins || port->kind == SerialKind::ftdi;
  for (const bool first : {true, false})
    for (const Asker& a : askers) {
      const bool ins = a.group == "ins";
      if ((ins == ins_first) != first || (!ins && port->kind == SerialKind::ins)) continue;
      const std::optional<DeviceInfo> who = a.is_there(port->info.port);
      if (!who) continue;
      port->device = fmt::format("{}{}{}, {}", a.driver, who->serial.empty() ? "" : " ",
                                 who->serial, who->model);
      port->configuration =
          fmt::format("{}: {{driver: {}, port: {}}}", a.group, a.driver, port->name());
      return;
    }
}

}  // namespace vergence::app
