#include "app/doctor/rig_devices.hpp"

#include <algorithm>
#include <filesystem>

#include <fmt/format.h>

namespace vergence::app {
namespace {

bool is_real(const std::string& driver) {
  return !driver.empty() && driver != "none" && driver != "mock";
}

/// How likely it is, by what carries the port, that a device of this kind is there: 0 is not.
int likelihood(const FoundPort& port, SerialKind wanted) {
  if (port.kind == wanted) return 2;
  return port.kind == SerialKind::ftdi || port.kind == SerialKind::converter ? 1 : 0;
}

void add_port(const Inventory& found, const std::string& group, const std::string& key,
              SerialKind kind, RigDevices* rig) {
  std::vector<const FoundPort*> candidates;
  int best = key.empty() ? 1 : 0;
  for (const FoundPort& port : found.ports) {
    if (!names_port(key, port)) continue;
    const int likely = key.empty() ? likelihood(port, kind) : 0;
    if (likely > best) candidates.clear();
    best = std::max(best, likely);
    if (likely == best) candidates.push_back(&port);
  }
  if (candidates.size() != 1) {
    rig->missing.push_back(
        candidates.empty() ? fmt::format("{}: no serial port is there for it", group)
                           : fmt::format("{}: {} serial ports may be meant; name one in {}.port",
                                         group, candidates.size(), group));
    return;
  }
  rig->inventory.ports.push_back(*candidates.front());
  rig->inventory.ports.back().kind = kind;
}

/// The USB device that a camera of the list is; null: none, or it is not on USB.
const UsbDevice* usb_device_of(const Inventory& found, const DeviceInfo& info) {
  const std::string node = std::filesystem::path(info.place).filename();
  for (const UsbDevice& d : found.usb) {
    if (info.driver == "v4l2" && std::find(d.video.begin(), d.video.end(), node) != d.video.end())
      return &d;
    // `usb 001/007` of /dev/bus/usb/001/007
    if (info.driver == "iidc-usb" &&
        d.node().ends_with(info.place.substr(info.place.find(' ') + 1)))
      return &d;
  }
  return nullptr;
}

void add_usb(const UsbDevice& device, Inventory* inventory) {
  const auto same = [&](const UsbDevice& d) { return d.port == device.port; };
  if (std::none_of(inventory->usb.begin(), inventory->usb.end(), same))
    inventory->usb.push_back(device);
}

void add_firewire(const iidc::FirewireNode& node, Inventory* inventory) {
  const auto same = [&](const iidc::FirewireNode& n) { return n.rom.guid == node.rom.guid; };
  if (std::none_of(inventory->firewire.begin(), inventory->firewire.end(), same))
    inventory->firewire.push_back(node);
}

/// Without a serial number every camera of that driver is meant.
bool means_camera(const CameraNeed& need, const DeviceInfo& info) {
  return info.driver == need.driver &&
         (need.serial.empty() || need.serial == info.serial || need.serial == info.place);
}

void add_camera(const Inventory& found, const CameraNeed& need, RigDevices* rig) {
  if (!is_real(need.driver) || need.driver == "gige") return;
  bool any = false;
  for (const DriverFindings& driver : found.drivers)
    for (const FoundCamera& camera : driver.cameras) {
      if (!means_camera(need, camera.info)) continue;
      any = true;
      if (const UsbDevice* device = usb_device_of(found, camera.info))
        add_usb(*device, &rig->inventory);
    }
  if (need.driver == "iidc-1394")
    for (const iidc::FirewireNode& node : found.firewire)
      if (need.serial.empty() || need.serial == fmt::format("{:016x}", node.rom.guid)) {
        any = true;
        add_firewire(node, &rig->inventory);
      }
  if (!any)
    rig->missing.push_back(fmt::format("{} ({}{}{}): it is not plugged in", need.key, need.driver,
                                       need.serial.empty() ? "" : " ", need.serial));
}

}  // namespace

Needs with_nodes(Needs needs, const Machine& machine) {
  for (std::string* port : {&needs.ins_port, &needs.trigger_port})
    if (port->starts_with("/")) *port = machine.target(*port);
  return needs;
}

bool names_port(const std::string& key, const FoundPort& port) {
  if (key.empty()) return port.info.usb_vendor != 0;
  const std::string name = std::filesystem::path(key).filename();
  const std::string& serial = port.info.usb_serial;
  return key == port.by_id || name == std::filesystem::path(port.info.port).filename() ||
         (!serial.empty() && (key == serial || key == "/dev/vergence/ins-" + serial ||
                              key == "/dev/vergence/trigger-" + serial));
}

RigDevices rig_devices(const Inventory& found, const Needs& needs) {
  RigDevices rig;
  if (is_real(needs.ins_driver)) add_port(found, "ins", needs.ins_port, SerialKind::ins, &rig);
  if (is_real(needs.trigger_driver))
    add_port(found, "trigger", needs.trigger_port, SerialKind::board, &rig);
  for (const CameraNeed& need : needs.cameras) add_camera(found, need, &rig);
  return rig;
}

}  // namespace vergence::app
