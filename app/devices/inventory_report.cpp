#include "app/devices/inventory_report.hpp"

#include <algorithm>
#include <cctype>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "app/runtime/terminal_text.hpp"
#include "app/runtime/version.hpp"

namespace vergence::app {

namespace {

/// At most 64 characters; those that mean something in a rule or a path become `other`: `?` matches
/// any one on the right side of `==`.
std::string plain_text(const std::string& text, char other) {
  std::string out = text.substr(0, 64);
  std::ranges::replace_if(
      out, [](unsigned char c) { return std::isalnum(c) == 0 && c != '.' && c != '_' && c != '-'; },
      other);
  return out;
}

/// Matches a device by vendor, product and, where it has one, serial number. `attribute`: ATTR of
/// the device itself, ATTRS of one below it.
std::string which(const char* attribute, std::uint16_t vendor, std::uint16_t product,
                  const std::string& serial) {
  std::string s = fmt::format("{0}{{idVendor}}==\"{1:04x}\", {0}{{idProduct}}==\"{2:04x}\"",
                              attribute, vendor, product);
  if (!serial.empty())
    s += fmt::format(", {}{{serial}}==\"{}\"", attribute, plain_text(serial, '?'));
  return s;
}

std::string port_rules(const FoundPort& port) {
  const SerialPortInfo& i = port.info;
  const std::string who = which("ATTRS", i.usb_vendor, i.usb_product, i.usb_serial);
  std::string out = fmt::format("\n# {}: {}\n", i.port, plain_text(i.description, ' '));
  out += fmt::format(
      "ENV{{DEVTYPE}}==\"usb_device\", {}, ENV{{ID_MM_DEVICE_IGNORE}}=\"1\", "
      "ATTR{{power/control}}=\"on\"\n",
      which("ATTR", i.usb_vendor, i.usb_product, i.usb_serial));
  out += fmt::format("SUBSYSTEM==\"tty\", {}, GROUP=\"dialout\", MODE=\"0660\", ", who);
  if (!i.usb_serial.empty())
    out += fmt::format("SYMLINK+=\"vergence/{}-{}\", ",
                       port.kind == SerialKind::ins     ? "ins"
                       : port.kind == SerialKind::board ? "trigger"
                                                        : "serial",
                       plain_text(i.usb_serial, '_'));
  out += "ENV{ID_MM_PORT_IGNORE}=\"1\"\n";
  if (is_ftdi(i.usb_vendor, i.usb_product))
    out += fmt::format(
        "ACTION==\"add|bind\", SUBSYSTEM==\"usb-serial\", DRIVER==\"ftdi_sio\", {}, "
        "ATTR{{latency_timer}}=\"16\"\n",
        who);
  return out;
}

std::string usb_camera_rules(const UsbDevice& d) {
  const std::string above = which("ATTRS", d.vendor, d.product, d.serial),
                    link = d.serial.empty() ? ""
                                            : fmt::format(", SYMLINK+=\"vergence/camera-{}\"",
                                                          plain_text(d.serial, '_'));
  std::string out = fmt::format(
      "\n# camera on USB {}: {}\nENV{{DEVTYPE}}==\"usb_device\", {}, GROUP=\"video\", "
      "MODE=\"0660\", ATTR{{power/control}}=\"on\"{}\n",
      d.port, plain_text(d.title, ' '), which("ATTR", d.vendor, d.product, d.serial),
      d.vendor == kPointGreyVendor ? link : "");
  if (d.video.empty()) return out;
  out += fmt::format("SUBSYSTEM==\"video4linux\", {}, GROUP=\"video\", MODE=\"0660\"\n", above);
  if (!link.empty())
    out += fmt::format("SUBSYSTEM==\"video4linux\", ATTR{{index}}==\"0\", {}{}\n", above, link);
  return out;
}

std::string firewire_rules(const iidc::FirewireNode& node) {
  return fmt::format(
      "\n# camera on IEEE 1394, {}: {}\nSUBSYSTEM==\"firewire\", ATTR{{guid}}==\"0x{:016x}\", "
      "GROUP=\"video\", MODE=\"0660\", SYMLINK+=\"vergence/camera-{:016x}\"\n",
      node.device, plain_text(node.rom.model.data(), ' '), node.rom.guid, node.rom.guid);
}

using Json = nlohmann::ordered_json;

std::string usb_ids(const SerialPortInfo& info) {
  return info.usb_vendor == 0 ? ""
                              : fmt::format("{:04x}:{:04x}", info.usb_vendor, info.usb_product);
}

// Column widths in characters.
constexpr std::size_t kState = 9, kCheck = 19, kWidth = 100;

std::size_t count(const std::vector<Finding>& findings, FindingState state) {
  return static_cast<std::size_t>(
      std::ranges::count_if(findings, [state](const Finding& f) { return f.state == state; }));
}

}  // namespace

std::string udev_rules(const Inventory& inventory) {
  std::string rules;
  for (const FoundPort& port : inventory.ports)
    if (port.info.usb_vendor != 0) rules += port_rules(port);
  for (const UsbDevice& d : inventory.usb)
    if (d.vendor == kPointGreyVendor || !d.video.empty()) rules += usb_camera_rules(d);
  for (const iidc::FirewireNode& node : inventory.firewire) rules += firewire_rules(node);

  const std::string head =
      "# Devices of this rig for members of the groups dialout (serial ports) and video (cameras), "
      "by `vergence devices --write-udev`.\n"
      "# Install: copy to /etc/udev/rules.d/98-vergence-rig.rules, then: udevadm control --reload "
      "&& udevadm trigger\n";
  if (rules.empty())
    return head + "# No connected device needs a rule. Network cameras never need one.\n";
  return head + "\nACTION==\"remove\", GOTO=\"vergence_rig_end\"\n" + rules +
         "\nLABEL=\"vergence_rig_end\"\n";
}

Inventory ports_of_rig(Inventory inventory, const Configuration& drive, const Machine& machine) {
  std::vector<FoundPort> ports;
  const auto add = [&](const std::string& driver, const std::string& key, SerialKind kind) {
    if (!is_real_driver(driver)) return;
    for (FoundPort port : inventory.ports) {
      const bool likely = port.kind == kind || port.kind == SerialKind::ftdi;
      if (!names_port(machine, key, port) || (key.empty() && !likely)) continue;
      port.kind = kind;
      ports.push_back(std::move(port));
    }
  };
  add(drive.ins.driver, drive.ins.port, SerialKind::ins);
  add(drive.trigger.driver, drive.trigger.port, SerialKind::board);
  inventory.ports = std::move(ports);
  return inventory;
}

std::string devices_text(const Inventory& inventory) {
  std::string cameras, ports, notes;
  for (const DriverFindings& d : inventory.drivers) {
    for (const DeviceInfo& c : d.cameras)
      cameras +=
          fmt::format("    {} {}  # {}, {}\n", c.serial.empty() && d.name != "gige" ? '#' : '-',
                      camera_line(c), harmless(c.model), harmless(c.place));
    if (d.cameras.empty() || !d.explanation.empty())
      notes += fmt::format("# {}: {}\n", d.name,
                           d.explanation.empty() ? "none found" : harmless(d.explanation));
  }
  for (const FoundPort& p : inventory.ports)
    ports += fmt::format(
        "  {}  # {} {} {}{}\n", p.configuration.empty() ? "# " + p.name() : p.configuration,
        to_string(p.kind), usb_ids(p.info), harmless(p.info.usb_serial),
        p.info.latency_timer_ms ? fmt::format(", latency timer {} ms", *p.info.latency_timer_ms)
                                : "");
  if (ports.empty()) notes += "# serial ports: none found\n";
  return (cameras.empty() ? "" : "  cameras:\n" + cameras) + ports + notes;
}

std::string devices_json(const Inventory& inventory, const std::string& rules) {
  Json cameras = Json::array(), drivers = Json::array(), ports = Json::array();
  for (const DriverFindings& d : inventory.drivers) {
    drivers.push_back({{"name", d.name},
                       {"meaning", d.meaning},
                       {"found", d.cameras.size()},
                       {"answered", d.answered},
                       {"note", d.explanation}});
    for (const DeviceInfo& c : d.cameras)
      cameras.push_back({{"driver", d.name},
                         {"serial", c.serial},
                         {"model", c.model},
                         {"place", c.place},
                         {"configuration", camera_line(c)}});
  }
  for (const FoundPort& p : inventory.ports)
    ports.push_back(
        {{"port", p.info.port},
         {"by_id", p.by_id},
         {"kind", to_string(p.kind)},
         {"usb_ids", usb_ids(p.info)},
         {"usb_serial", p.info.usb_serial},
         {"description", p.info.description},
         {"latency_timer_ms", p.info.latency_timer_ms ? Json(*p.info.latency_timer_ms) : Json()},
         {"configuration", p.configuration}});
  Json all{{"schema_version", kSchemaVersion},
           {"cameras", cameras},
           {"serial_ports", ports},
           {"drivers", drivers}};
  if (!rules.empty()) all["udev_rules"] = rules;
  return all.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string doctor_text(const std::vector<Finding>& findings, bool given) {
  std::string text;
  const std::string margin(kState + kCheck, ' ');
  for (const Finding& f : findings) {
    std::string head = padded(to_string(f.state), kState) + padded(f.check, kCheck);
    for (const std::string& line : wrapped(harmless(f.message), kWidth - margin.size())) {
      text += head + line + "\n";
      head = margin;
    }
    // A command is never wrapped, because users copy it.
    for (const std::string& command : f.fix) text += margin + "  " + harmless(command) + "\n";
    if (!f.fix.empty()) text += "\n";
  }
  if (!text.ends_with("\n\n")) text += "\n";
  text += fmt::format("problems: {}, advice: {}, ok: {}\n", count(findings, FindingState::problem),
                      count(findings, FindingState::advice), count(findings, FindingState::ok));
  if (!given) text += "To check a configuration: vergence doctor CONFIG\n";
  return text;
}

std::string doctor_json(const std::vector<Finding>& findings) {
  Json rows = Json::array();
  for (const Finding& f : findings)
    rows.push_back({{"check", f.check},
                    {"state", to_string(f.state)},
                    {"message", f.message},
                    {"fix", f.fix}});
  const Json all{{"schema_version", kSchemaVersion},
                 {"problems", count(findings, FindingState::problem)},
                 {"advice", count(findings, FindingState::advice)},
                 {"ok", count(findings, FindingState::ok)},
                 {"findings", rows}};
  return all.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace vergence::app
