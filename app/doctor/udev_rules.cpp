#include "app/doctor/udev_rules.hpp"

#include <algorithm>
#include <cctype>

#include <fmt/format.h>

namespace vergence::app {
namespace {

bool plain(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '.' || c == '_' || c == '-';
}

/// At most 64 letters; those that mean something in a rule or a path become `other`.
std::string plain_text(const std::string& text, char other) {
  std::string out = text.substr(0, 64);
  std::replace_if(
      out.begin(), out.end(), [](char c) { return !plain(c); }, other);
  return out;
}

/// The right side of `==`, which is a pattern.
std::string pattern(const std::string& text) { return plain_text(text, '?'); }

/// A name under /dev/vergence.
std::string part_of_name(const std::string& text) { return plain_text(text, '_'); }

/// For a comment: one line.
std::string comment(const std::string& text) {
  std::string out = text.substr(0, 80);
  std::replace_if(
      out.begin(), out.end(), [](unsigned char c) { return c < 0x20 || c >= 0x7F; }, '?');
  return out;
}

/// Matches a device by vendor, product and, where it has one, serial number. `attribute`: ATTR of
/// the device itself, ATTRS of one below it.
std::string which(const char* attribute, std::uint16_t vendor, std::uint16_t product,
                  const std::string& serial) {
  std::string s = fmt::format("{0}{{idVendor}}==\"{1:04x}\", {0}{{idProduct}}==\"{2:04x}\"",
                              attribute, vendor, product);
  if (!serial.empty()) s += fmt::format(", {}{{serial}}==\"{}\"", attribute, pattern(serial));
  return s;
}

const char* name_of(SerialKind kind) {
  if (kind == SerialKind::ins) return "ins";
  return kind == SerialKind::board ? "trigger" : "serial";
}

std::string port_rules(const FoundPort& port) {
  const SerialPortInfo& i = port.info;
  const std::string who = which("ATTRS", i.usb_vendor, i.usb_product, i.usb_serial);
  std::string out = fmt::format("\n# {}: {}\n", i.port, comment(i.description));
  out += fmt::format(
      "ENV{{DEVTYPE}}==\"usb_device\", {}, ENV{{ID_MM_DEVICE_IGNORE}}=\"1\", "
      "ATTR{{power/control}}=\"on\"\n",
      which("ATTR", i.usb_vendor, i.usb_product, i.usb_serial));
  out += fmt::format("SUBSYSTEM==\"tty\", {}, GROUP=\"dialout\", MODE=\"0660\", ", who);
  if (!i.usb_serial.empty())
    out += fmt::format("SYMLINK+=\"vergence/{}-{}\", ", name_of(port.kind),
                       part_of_name(i.usb_serial));
  out += "ENV{ID_MM_PORT_IGNORE}=\"1\"\n";
  if (is_ftdi(i.usb_vendor, i.usb_product))
    out += fmt::format(
        "ACTION==\"add|bind\", SUBSYSTEM==\"usb-serial\", DRIVER==\"ftdi_sio\", {}, "
        "ATTR{{latency_timer}}=\"16\"\n",
        who);
  return out;
}

std::string usb_camera_rules(const UsbDevice& d) {
  const bool iidc = d.vendor == kPointGreyVendor;
  std::string out = fmt::format("\n# camera on USB {}: {}\n", d.port, comment(d.title));
  out += fmt::format(
      "ENV{{DEVTYPE}}==\"usb_device\", {}, GROUP=\"video\", MODE=\"0660\", "
      "ATTR{{power/control}}=\"on\"",
      which("ATTR", d.vendor, d.product, d.serial));
  if (iidc && !d.serial.empty())
    out += fmt::format(", SYMLINK+=\"vergence/camera-{}\"", part_of_name(d.serial));
  out += "\n";
  if (!d.video.empty())
    out += fmt::format("SUBSYSTEM==\"video4linux\", {}, GROUP=\"video\", MODE=\"0660\"\n",
                       which("ATTRS", d.vendor, d.product, d.serial));
  if (!d.video.empty() && !d.serial.empty())
    out += fmt::format(
        "SUBSYSTEM==\"video4linux\", ATTR{{index}}==\"0\", {}, SYMLINK+=\"vergence/camera-{}\"\n",
        which("ATTRS", d.vendor, d.product, d.serial), part_of_name(d.serial));
  return out;
}

std::string firewire_rules(const iidc::FirewireNode& node) {
  return fmt::format(
      "\n# camera on IEEE 1394, {}: {}\nSUBSYSTEM==\"firewire\", ATTR{{guid}}==\"0x{:016x}\", "
      "GROUP=\"video\", MODE=\"0660\", "
      "SYMLINK+=\"vergence/camera-{:016x}\"\n",
      node.device, comment(node.rom.model.data()), node.rom.guid, node.rom.guid);
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
      "# Devices of this rig for members of the groups dialout (serial lines) and video (cameras), "
      "by `vergence devices --write-udev`.\n"
      "# Install: copy to /etc/udev/rules.d/98-vergence-rig.rules, then: udevadm control --reload "
      "&& udevadm trigger\n";
  if (rules.empty())
    return head + "# Nothing that needs a rule is plugged in. Network cameras need none.\n";
  return head + "\nACTION==\"remove\", GOTO=\"vergence_rig_end\"\n" + rules +
         "\nLABEL=\"vergence_rig_end\"\n";
}

Inventory ports_of_rig(Inventory inventory, const Needs& needs, const Machine& machine) {
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
  add(needs.ins_driver, needs.ins_port, SerialKind::ins);
  add(needs.trigger_driver, needs.trigger_port, SerialKind::board);
  inventory.ports = std::move(ports);
  return inventory;
}

}  // namespace vergence::app
