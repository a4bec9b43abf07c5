#include <algorithm>
#include <filesystem>
#include <set>
#include <sstream>
#include <string_view>

#include <fmt/format.h>

#include "app/doctor/checks.hpp"
#include "app/doctor/permissions.hpp"
#include "app/doctor/rig_devices.hpp"

namespace vergence::app {
namespace {

constexpr int kAdvisedLatency = 16;  // ms: docs/ins.md

bool is_real(const std::string& driver) {
  return !driver.empty() && driver != "none" && driver != "mock";
}

bool may_be_ins(const CheckContext& p, const FoundPort& port) {
  return is_real(p.needs.ins_driver) && names_port(p.needs.ins_port, port);
}

/// Ports that anybody here cares about: those of the configuration, without one all on USB.
std::vector<const FoundPort*> ports_of(const CheckContext& p) {
  std::vector<const FoundPort*> some;
  for (const FoundPort& port : p.inventory.ports) {
    const bool trigger = is_real(p.needs.trigger_driver) && names_port(p.needs.trigger_port, port);
    if (p.needs.given ? may_be_ins(p, port) || trigger : port.info.usb_vendor != 0)
      some.push_back(&port);
  }
  return some;
}

/// A configured port is there; without one there is any.
void check_presence(const CheckContext& p, const std::string& group, const std::string& driver,
                    const std::string& port, std::vector<Finding>* findings) {
  if (!is_real(driver)) return;
  if (!port.empty()) {
    if (!p.machine.exists(port))
      findings->push_back(
          {group,
           FindingState::problem,
           fmt::format("{}.port: {} is not there; `vergence devices` lists the ports", group, port),
           {}});
    return;
  }
  const auto on_usb = std::count_if(p.inventory.ports.begin(), p.inventory.ports.end(),
                                    [](const auto& f) { return f.info.usb_vendor != 0; });
  if (on_usb == 0)
    findings->push_back({group,
                         FindingState::problem,
                         fmt::format("{}: no serial port on USB is there; plug it in", group),
                         {}});
  else if (group == "ins" && on_usb > 1)
    findings->push_back({group,
                         FindingState::problem,
                         fmt::format("there are {} serial ports on USB; name the INS's in ins.port "
                                     "(`vergence devices --probe` asks)",
                                     on_usb),
                         {}});
}

void check_latency(const CheckContext& p, std::vector<Finding>* findings) {
  for (const FoundPort* found : ports_of(p)) {
    const FoundPort& port = *found;
    const bool ins = port.kind == SerialKind::ins || port.kind == SerialKind::ftdi;
    if (!port.info.latency_timer_ms || !ins || (p.needs.given && !may_be_ins(p, port))) continue;
    const int ms = *port.info.latency_timer_ms;
    Finding f{"latency_timer",
              FindingState::ok,
              fmt::format("{}: the converter's latency timer is {} ms", port.info.port, ms),
              {}};
    if (ms != kAdvisedLatency) {
      f.state = FindingState::advice;
      f.sentence +=
          fmt::format("; the INS's stamps are best with {} ms (docs/ins.md)", kAdvisedLatency);
      f.mend = {
          fmt::format("echo {} | sudo tee /sys/bus/usb-serial/devices/{}/latency_timer",
                      kAdvisedLatency, std::filesystem::path(port.info.port).filename().string()),
          commands_to_install_rules().front()};
    }
    findings->push_back(std::move(f));
  }
}

/// What udev noted for the port: the rule that keeps ModemManager away leaves its mark there.
bool is_ignored_by_modem_manager(const Machine& m, const std::string& port) {
  const auto number =
      m.line("/sys/class/tty/" + std::filesystem::path(port).filename().string() + "/dev");
  if (!number || number->find_first_not_of("0123456789:") != std::string::npos) return false;
  const auto notes = m.text("/run/udev/data/c" + *number);
  return notes && (notes->find("ID_MM_DEVICE_IGNORE=1") != std::string::npos ||
                   notes->find("ID_MM_PORT_IGNORE=1") != std::string::npos);
}

void check_modem_manager(const CheckContext& p, std::vector<Finding>* findings) {
  std::vector<std::string> exposed;
  bool any = false;
  for (const FoundPort* port : ports_of(p)) {
    if (port->info.usb_vendor == 0) continue;
    any = true;
    if (!is_ignored_by_modem_manager(p.machine, port->info.port))
      exposed.push_back(port->info.port);
  }
  if (!any || !p.machine.runs("ModemManager")) return;
  if (exposed.empty()) {
    findings->push_back({"modem_manager",
                         FindingState::ok,
                         "ModemManager runs and leaves the serial ports alone",
                         {}});
    return;
  }
  std::vector<std::string> mend = commands_to_install_rules();
  mend.emplace_back("sudo systemctl disable --now ModemManager");
  findings->push_back({"modem_manager", FindingState::advice,
                       fmt::format("ModemManager runs and may write to {} when it is plugged in, "
                                   "which confuses an INS: keep it away by "
                                   "udev rules, or, where there is no modem, switch it off",
                                   fmt::join(exposed, ", ")),
                       std::move(mend)});
}

/// The kernel writes its messages there, and systemd then starts a login by itself.
bool is_console(const Machine& m, const std::string& node) {
  constexpr std::string_view kKey = "console=";
  std::istringstream words(m.line("/proc/cmdline").value_or(""));
  for (std::string word; words >> word;)
    if (word.starts_with(kKey) &&
        m.target("/dev/" + word.substr(kKey.size(), word.find(',') - kKey.size())) == node)
      return true;
  return false;
}

/// A port of the board itself: Debian gives it to dialout, a login that runs there takes it away.
NodesToOpen built_in_port(const Machine& m, const std::string& node) {
  const std::string name = std::filesystem::path(node).filename();
  NodesToOpen one{"serial_permission", "dialout", {node}};
  one.because = "a serial console (getty) may hold it";
  const bool console = is_console(m, node);
  if (console)
    one.because += ", since console= of the kernel's command line names it: take that out";
  // What a generator starts at every boot can only be masked.
  one.mend = {
      fmt::format("sudo systemctl {} --now serial-getty@{}", console ? "mask" : "disable", name),
      "sudo udevadm trigger --name-match=" + name};
  return one;
}

void check_permissions(const CheckContext& p, std::vector<Finding>* findings) {
  NodesToOpen on_usb{"serial_permission", "dialout", {}};
  std::set<std::string> built_in;
  for (const FoundPort* port : ports_of(p))
    if (port->info.usb_vendor != 0)
      on_usb.nodes.push_back(port->info.port);
    else
      built_in.insert(port->info.port);
  // Nodes that no list of ports has are asked for all the same.
  const auto add = [&](const std::string& driver, const std::string& port) {
    const bool listed = std::any_of(p.inventory.ports.begin(), p.inventory.ports.end(),
                                    [&](const FoundPort& f) { return names_port(port, f); });
    if (is_real(driver) && port.starts_with("/") && !listed && p.machine.exists(port))
      built_in.insert(port);
  };
  add(p.needs.ins_driver, p.needs.ins_port);
  add(p.needs.trigger_driver, p.needs.trigger_port);
  check_nodes(p, on_usb, findings);
  for (const std::string& node : built_in) check_nodes(p, built_in_port(p.machine, node), findings);
}

}  // namespace

void check_serial(const CheckContext& context, std::vector<Finding>* findings) {
  const Needs& named = context.needs;
  check_presence(context, "ins", named.ins_driver, named.ins_port, findings);
  check_presence(context, "trigger", named.trigger_driver, named.trigger_port, findings);
  const Needs needs = with_nodes(named, context.machine);
  const CheckContext p{context.machine, context.inventory, needs, context.out,
                       context.configuration};
  check_permissions(p, findings);
  check_latency(p, findings);
  check_modem_manager(p, findings);
}

}  // namespace vergence::app
