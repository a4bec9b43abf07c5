#include <algorithm>
#include <set>

#include <fmt/format.h>
#include <strings.h>

#include "app/doctor/checks.hpp"

namespace vergence::app {
namespace {

const std::vector<std::string> kInstallRules{
    "vergence devices --write-udev | sudo tee /etc/udev/rules.d/98-vergence-rig.rules",
    "sudo udevadm control --reload && sudo udevadm trigger"};

const DriverFindings* find_driver(const Inventory& inventory, const std::string& driver) {
  for (const DriverFindings& d : inventory.drivers)
    if (d.name == driver) return &d;
  return nullptr;
}

/// By serial, address or node, or by any link to the node.
bool means(const Machine& machine, const std::string& requested, const DeviceInfo& camera) {
  return strcasecmp(requested.c_str(), camera.serial.c_str()) == 0 || requested == camera.place ||
         (requested.starts_with("/dev/") && machine.target(requested) == camera.place);
}

/// Serials of the cameras that a driver found, or why there is none.
std::string list_of(const DriverFindings* d) {
  if (d == nullptr) return "no such driver";
  if (d->cameras.empty()) return d->note.empty() ? "none is there" : "none is there: " + d->note;
  std::vector<std::string> names;
  for (const DeviceInfo& c : d->cameras) names.push_back(c.serial.empty() ? c.place : c.serial);
  return fmt::format("there: {}", fmt::join(names, ", "));
}

void check_cameras(const CheckContext& p, std::vector<Finding>* findings) {
  for (const DriverFindings& d : p.inventory.drivers)
    if (!d.answered)
      findings->push_back(
          {"cameras", FindingState::problem, d.name + ": " + d.note, {"sudo dmesg | tail -30"}});
  const auto matched = match_cameras(p);
  std::vector<std::string> present;
  for (std::size_t k = 0; k < matched.size(); ++k) {
    const CameraNeed& n = p.needs.cameras[k];
    if (n.driver == "mock") continue;
    const std::string who = n.name.empty() ? n.key : fmt::format("{} ({})", n.key, n.name);
    if (matched[k] != nullptr)
      present.push_back(fmt::format("{} is {} {}", who, n.driver, matched[k]->serial));
    else if (n.driver == "gige" && std::count(n.serial.begin(), n.serial.end(), '.') == 3)
      findings->push_back({"cameras",
                           FindingState::advice,
                           who + ": no camera at " + n.serial +
                               " answers a broadcast; behind a router that is normal, else check "
                               "cable, power and address",
                           {"ping -c 3 " + n.serial}});
    else
      findings->push_back({"cameras",
                           FindingState::problem,
                           fmt::format("{}: the {} camera{} is not there ({}); check cable, power "
                                       "and serial",
                                       who, n.driver, n.serial.empty() ? "" : " " + n.serial,
                                       list_of(find_driver(p.inventory, n.driver))),
                           {}});
  }
  if (!present.empty())
    findings->push_back(
        {"cameras", FindingState::ok, fmt::format("{}", fmt::join(present, ", ")), {}});
}

/// Nodes of one kind, and the group that should own them.
struct NodesToOpen {
  std::string check, group;
  std::vector<std::string> nodes;
};

/// Checks that this user may read and write the nodes; if not, the cause is another login,
/// membership, or a rule that gives the node to the group.
void check_nodes(const CheckContext& p, const NodesToOpen& o, std::vector<Finding>* findings) {
  std::vector<std::string> closed;
  std::copy_if(o.nodes.begin(), o.nodes.end(), std::back_inserter(closed),
               [&](const std::string& node) { return !p.machine.may_use(node); });
  if (o.nodes.empty()) return;
  Finding f{
      o.check, FindingState::ok, fmt::format("{} may be opened", fmt::join(o.nodes, ", ")), {}};
  if (!closed.empty()) {
    f.state = FindingState::problem;
    f.message = fmt::format("{} may not be opened: ", fmt::join(closed, ", "));
    const bool of_group = std::all_of(closed.begin(), closed.end(), [&](const std::string& node) {
      return p.machine.group_of(node) == o.group;
    });
    if (!of_group || p.machine.in_group(o.group)) {
      f.message += fmt::format(
          "they are not open to group {} (mode 0660); install the udev rules, or end a serial "
          "console that holds the port (sudo systemctl mask --now serial-getty@NAME)",
          o.group);
      f.mend = kInstallRules;
    } else {
      f.message += fmt::format("{} is not in group {}; add, then log out and in again",
                               p.machine.user, o.group);
      f.mend = {fmt::format("sudo usermod -aG {} {}", o.group, p.machine.user)};
    }
  }
  findings->push_back(std::move(f));
}

/// Nodes of everything that looks like a camera of a kind that is asked for; without a
/// configuration of every kind.
std::vector<std::string> camera_nodes(const CheckContext& p) {
  const auto asked = [&p](const char* driver) {
    return !p.needs.given || !p.needs.of(driver).empty();
  };
  std::vector<std::string> nodes;
  if (asked("v4l2"))
    for (const std::string& name : p.machine.names("/sys/class/video4linux"))
      if (name.starts_with("video") && p.machine.exists("/dev/" + name))
        nodes.push_back("/dev/" + name);
  if (asked("iidc-usb"))
    for (const UsbDevice& d : p.inventory.usb)
      if (d.vendor == kPointGreyVendor) nodes.push_back(d.node());
  if (asked("iidc-1394"))
    for (const iidc::FirewireNode& n : p.inventory.firewire) nodes.push_back(n.device);
  return nodes;
}

/// Serial ports that matter: those of the configuration, without one all on USB.
std::vector<const FoundPort*> ports_of(const CheckContext& p, bool ins, bool trigger) {
  const Needs& n = p.needs;
  std::vector<const FoundPort*> some;
  for (const FoundPort& port : p.inventory.ports)
    if (n.given
            ? (ins && is_real_driver(n.ins_driver) && names_port(p.machine, n.ins_port, port)) ||
                  (trigger && is_real_driver(n.trigger_driver) &&
                   names_port(p.machine, n.trigger_port, port))
            : port.info.usb_vendor != 0)
      some.push_back(&port);
  return some;
}

/// The configuration means one serial port that is there.
void check_port(const CheckContext& p, const std::string& group, const std::string& driver,
                const std::string& key, std::vector<Finding>* findings) {
  if (!is_real_driver(driver) || (!key.empty() && p.machine.exists(key))) return;
  const auto meant = std::count_if(p.inventory.ports.begin(), p.inventory.ports.end(),
                                   [&](const auto& f) { return names_port(p.machine, key, f); });
  if (meant == 0 || (meant > 1 && group == "ins"))
    findings->push_back({group,
                         FindingState::problem,
                         fmt::format("{}.port: {}: {} serial ports are meant by it; name one that "
                                     "`vergence devices` lists",
                                     group, key.empty() ? "empty" : key, meant),
                         {}});
}

void check_serial_permission(const CheckContext& p, std::vector<Finding>* findings) {
  std::set<std::string> nodes;
  for (const FoundPort* port : ports_of(p, true, true)) nodes.insert(port->info.port);
  // A port that the list lacks, for instance of the board itself, is checked all the same.
  const auto add = [&](const std::string& driver, const std::string& port) {
    if (is_real_driver(driver) && port.starts_with("/") && p.machine.exists(port))
      nodes.insert(p.machine.target(port));
  };
  add(p.needs.ins_driver, p.needs.ins_port);
  add(p.needs.trigger_driver, p.needs.trigger_port);
  check_nodes(p, {"serial_permission", "dialout", {nodes.begin(), nodes.end()}}, findings);
}

void check_latency(const CheckContext& p, std::vector<Finding>* findings) {
  constexpr int kAdvisedLatency = 16;  // ms: docs/ins.md
  for (const FoundPort* port : ports_of(p, true, false)) {
    const bool ins = port->kind == SerialKind::ins || port->kind == SerialKind::ftdi;
    if (!port->info.latency_timer_ms || !ins) continue;
    const int ms = *port->info.latency_timer_ms;
    Finding f{"latency_timer",
              FindingState::ok,
              fmt::format("{}: the converter's latency timer is {} ms", port->info.port, ms),
              {}};
    if (ms != kAdvisedLatency) {
      f.state = FindingState::advice;
      f.message +=
          fmt::format("; the INS's stamps are best with {} ms (docs/ins.md)", kAdvisedLatency);
      f.mend = {
          fmt::format("echo {} | sudo tee /sys/bus/usb-serial/devices/{}/latency_timer",
                      kAdvisedLatency, std::filesystem::path(port->info.port).filename().string()),
          kInstallRules.front()};
    }
    findings->push_back(std::move(f));
  }
}

}  // namespace

std::vector<const DeviceInfo*> match_cameras(const CheckContext& p) {
  std::vector<const DeviceInfo*> matched(p.needs.cameras.size(), nullptr);
  // Entries that name a camera come first; the others take what is left.
  for (const bool named : {true, false})
    for (std::size_t k = 0; k < matched.size(); ++k) {
      const CameraNeed& n = p.needs.cameras[k];
      const DriverFindings* d = find_driver(p.inventory, n.driver);
      if (d == nullptr || n.serial.empty() == named) continue;
      for (const DeviceInfo& c : d->cameras)
        if (std::find(matched.begin(), matched.end(), &c) == matched.end() &&
            (!named || means(p.machine, n.serial, c))) {
          matched[k] = &c;
          break;
        }
    }
  return matched;
}

void check_devices(const CheckContext& p, std::vector<Finding>* findings) {
  check_cameras(p, findings);
  check_nodes(p, {"camera_permission", "video", camera_nodes(p)}, findings);
  check_port(p, "ins", p.needs.ins_driver, p.needs.ins_port, findings);
  check_port(p, "trigger", p.needs.trigger_driver, p.needs.trigger_port, findings);
  check_serial_permission(p, findings);
  check_latency(p, findings);
}

}  // namespace vergence::app
