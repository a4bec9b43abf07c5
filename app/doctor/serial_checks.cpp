#include <algorithm>
#include <filesystem>

#include <fmt/format.h>

#include "app/doctor/checks.hpp"
#include "app/doctor/permissions.hpp"

namespace vergence::app {
namespace {

constexpr int kAdvisedLatency = 16;  // ms: docs/ins.md

bool is_ins_port(const Patient& p, const FoundPort& port) {
  return !p.needs.ins_port.empty() &&
         (p.needs.ins_port == port.info.port || p.needs.ins_port == port.by_id ||
          std::filesystem::path(p.needs.ins_port).filename() == std::filesystem::path(port.info.port).filename());
}

void check_presence(const Patient& p, std::vector<Finding>* findings) {
  if (!p.needs.given || p.needs.ins_driver == "none" || p.needs.ins_driver == "mock") return;
  const auto on_usb =
      std::count_if(p.inventory.ports.begin(), p.inventory.ports.end(), [](const auto& f) { return f.info.usb_vendor != 0; });
  if (!p.needs.ins_port.empty()) {
    if (!p.machine.exists(p.needs.ins_port))
      findings->push_back({"ins",
                           FindingState::problem,
                           fmt::format("ins.port: {} is not there; `vergence devices` lists the ports", p.needs.ins_port),
                           {}});
  } else if (on_usb != 1) {
    findings->push_back({"ins",
                         FindingState::problem,
                         on_usb == 0 ? std::string("the INS's converter is not there: no serial port on USB")
                                     : fmt::format("there are {} serial ports on USB; name the INS's in ins.port", on_usb),
                         {}});
  }
}

void check_latency(const Patient& p, std::vector<Finding>* findings) {
  for (const FoundPort& port : p.inventory.ports) {
    if (!port.info.latency_timer_ms) continue;
    // Of a converter that is somebody else's business nothing is said.
    const bool ours = port.kind == SerialKind::ins || is_ins_port(p, port) || (p.needs.ins_port.empty() && port.kind == SerialKind::ftdi);
    if (!ours) continue;
    const int ms = *port.info.latency_timer_ms;
    Finding f{"latency_timer", FindingState::ok, fmt::format("{}: the converter's latency timer is {} ms", port.info.port, ms), {}};
    if (ms != kAdvisedLatency) {
      f.state = FindingState::advice;
      f.sentence += fmt::format("; the INS's stamps are best with {} ms (docs/ins.md)", kAdvisedLatency);
      f.mend = {fmt::format("echo {} | sudo tee /sys/bus/usb-serial/devices/{}/latency_timer", kAdvisedLatency,
                            std::filesystem::path(port.info.port).filename().string()),
                commands_to_install_rules().front()};
    }
    findings->push_back(std::move(f));
  }
}

/// What udev noted for the port: the rule that keeps ModemManager away leaves its mark there.
bool is_ignored_by_modem_manager(const Machine& m, const std::string& port) {
  const auto number = m.line("/sys/class/tty/" + std::filesystem::path(port).filename().string() + "/dev");
  if (!number || number->find_first_not_of("0123456789:") != std::string::npos) return false;
  const auto notes = m.text("/run/udev/data/c" + *number);
  return notes && (notes->find("ID_MM_DEVICE_IGNORE=1") != std::string::npos || notes->find("ID_MM_PORT_IGNORE=1") != std::string::npos);
}

void check_modem_manager(const Patient& p, std::vector<Finding>* findings) {
  std::vector<std::string> exposed;
  bool any = false;
  for (const FoundPort& port : p.inventory.ports) {
    if (port.info.usb_vendor == 0) continue;
    any = true;
    if (!is_ignored_by_modem_manager(p.machine, port.info.port)) exposed.push_back(port.info.port);
  }
  if (!any || !p.machine.runs("ModemManager")) return;
  if (exposed.empty()) {
    findings->push_back({"modem_manager", FindingState::ok, "ModemManager runs and leaves the serial ports alone", {}});
    return;
  }
  std::vector<std::string> mend = commands_to_install_rules();
  mend.emplace_back("sudo systemctl disable --now ModemManager");
  findings->push_back({"modem_manager", FindingState::advice,
                       fmt::format("ModemManager runs and may write to {} when it is plugged in, which confuses an INS: keep it away by "
                                   "udev rules, or, where there is no modem, switch it off",
                                   fmt::join(exposed, ", ")),
                       std::move(mend)});
}

}  // namespace

void check_serial(const Patient& p, std::vector<Finding>* findings) {
  NodesToOpen nodes{"serial_permission", "dialout", {}};
  for (const FoundPort& port : p.inventory.ports)
    if (port.info.usb_vendor != 0 || is_ins_port(p, port)) nodes.nodes.push_back(port.info.port);
  check_presence(p, findings);
  check_nodes(p, nodes, findings);
  check_latency(p, findings);
  check_modem_manager(p, findings);
}

}  // namespace vergence::app
