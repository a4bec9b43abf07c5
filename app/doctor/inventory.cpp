#include "app/doctor/inventory.hpp"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <memory>
#include <mutex>
#include <system_error>
#include <thread>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "app/doctor/probe.hpp"
#include "app/runtime/camera_drivers.hpp"
#include "drivers/v4l2/v4l2.hpp"

namespace vergence::app {
namespace fs = std::filesystem;
namespace {

/// What a driver's own thread leaves behind; it may outlive the one that waits.
struct Search {
  std::mutex mutex;
  std::condition_variable changed;
  bool done = false;
  std::vector<DeviceInfo> found;
  std::string note;
};

std::shared_ptr<Search> begin_search(const CameraDriverRow& row) {
  auto search = std::make_shared<Search>();
  std::thread([search, make = row.make] {
    std::vector<DeviceInfo> found;
    std::string note;
    try {
      const auto driver = make();
      found = driver->enumerate();
      note = driver->last_error();
    } catch (const std::exception& e) {
      note = std::string("it cannot look: ") + e.what();
    }
    const std::lock_guard lock(search->mutex);
    search->found = std::move(found);
    search->note = std::move(note);
    search->done = true;
    search->changed.notify_all();
  }).detach();
  return search;
}

/// What a node of /dev/videoN belongs to: the same text for nodes of one device. Devices of one
/// driver may have one parent, and cheap cameras one serial number; both are the same for nodes of
/// one device only.
std::string owner_of(const Machine& machine, const std::vector<UsbDevice>& usb,
                     const DeviceInfo& info) {
  const std::string node = fs::path(info.place).filename(),
                    serial = info.serial.substr(0, info.serial.rfind('#'));
  for (const UsbDevice& d : usb)
    if (std::find(d.video.begin(), d.video.end(), node) != d.video.end())
      return d.port + " " + serial;
  std::error_code error;
  const fs::path device =
      fs::canonical(machine.root / ("sys/class/video4linux/" + node + "/device"), error);
  return (error ? info.place : device.string()) + " " + serial;
}

std::string link_to(const Machine& machine, const std::string& port) {
  constexpr const char* kLinks = "/dev/serial/by-id/";
  for (const std::string& name : machine.names(kLinks)) {
    std::error_code error;
    const fs::path target =
        fs::read_symlink(machine.root / (std::string(kLinks + 1) + name), error);
    if (!error && target.filename() == fs::path(port).filename()) return kLinks + name;
  }
  return {};
}

std::vector<FoundPort> list_ports(const Machine& machine) {
  std::vector<FoundPort> ports;
  for (SerialPortInfo& info : list_serial_ports()) {
    FoundPort p;
    p.kind = serial_kind(info.usb_vendor, info.usb_product);
    p.by_id = link_to(machine, info.port);
    p.info = std::move(info);
    if (p.kind == SerialKind::ins) p.configuration = "ins: {driver: xsens, port: " + p.name() + "}";
    ports.push_back(std::move(p));
  }
  return ports;
}

}  // namespace

std::size_t Inventory::cameras() const noexcept {
  std::size_t n = 0;
  for (const DriverFindings& d : drivers) n += d.cameras.size();
  return n;
}

std::vector<FoundCamera> one_entry_a_device(const Machine& machine,
                                            const std::vector<UsbDevice>& usb,
                                            const std::vector<DeviceInfo>& found) {
  std::vector<FoundCamera> all;
  std::vector<std::string> owners;
  for (const DeviceInfo& info : found) {
    const bool node = info.place.starts_with("/dev/video");
    const std::string owner = node ? owner_of(machine, usb, info) : std::string();
    const auto same = owner.empty() ? owners.end() : std::find(owners.begin(), owners.end(), owner);
    if (same != owners.end()) {
      all[static_cast<std::size_t>(same - owners.begin())].also.push_back(info.serial);
      continue;
    }
    owners.push_back(owner);
    all.push_back({info, {}, {}});
  }
  return all;
}

Inventory take_inventory(const Machine& machine, const InventoryOptions& options) {
  Inventory inventory;
  std::vector<std::pair<const CameraDriverRow*, std::shared_ptr<Search>>> searches;
  for (const CameraDriverRow& row : camera_driver_rows())
    if (options.drivers.empty() || std::find(options.drivers.begin(), options.drivers.end(),
                                             row.name) != options.drivers.end())
      searches.emplace_back(&row, begin_search(row));
  inventory.usb = list_usb_devices(machine);
  inventory.firewire = iidc::list_firewire_cameras(machine.root / "sys");
  inventory.ports = list_ports(machine);
  if (options.probe)
    for (FoundPort& port : inventory.ports) probe(&port, all_askers());

  const auto until =
      std::chrono::steady_clock::now() + std::chrono::nanoseconds(options.limit.ns());
  for (const auto& [row, search] : searches) {
    DriverFindings d;
    d.name = row->name;
    d.meaning = row->meaning;
    std::unique_lock lock(search->mutex);
    d.answered = search->changed.wait_until(lock, until, [&s = *search] { return s.done; });
    if (d.answered) {
      d.cameras = one_entry_a_device(machine, inventory.usb, search->found);
      d.note = search->note;
      for (FoundCamera& c : d.cameras)
        if (c.info.driver == "v4l2") c.media = v4l2::media_advice(c.info.place);
    } else {
      d.note = fmt::format(
          "no answer within {:.0f} s: a device or its kernel driver hangs; unplug it, and look at "
          "dmesg",
          options.limit.to_seconds());
    }
    inventory.drivers.push_back(std::move(d));
  }
  return inventory;
}

std::string quoted(const std::string& text) {
  return nlohmann::json(text).dump(-1, ' ', true, nlohmann::json::error_handler_t::replace);
}

std::string camera_line(const DeviceInfo& info) {
  const std::string& name = info.serial.empty() && info.driver == "gige" ? info.place : info.serial;
  return fmt::format("{{driver: {}, serial: {}}}", info.driver, quoted(name));
}

}  // namespace vergence::app
