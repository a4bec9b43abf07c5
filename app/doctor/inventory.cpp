#include "app/doctor/inventory.hpp"

#include <algorithm>
#include <array>
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

#include "app/devices/camera_drivers.hpp"

namespace vergence::app {
namespace fs = std::filesystem;
namespace {

constexpr std::uint16_t kFtdi = 0x0403, kXsens = 0x2639;

/// Vendors of boards that bring USB with them, or a converter that hardly anything else has.
constexpr std::array<std::uint16_t, 9> kBoardVendors{
    0x2341,  // Arduino
    0x2A03,  // Arduino (dog hunter)
    0x16C0,  // Teensy, and others of that shared id
    0x2E8A,  // Raspberry Pi: Pico
    0x0483,  // STMicroelectronics: virtual COM port, ST-Link
    0x239A,  // Adafruit
    0x303A,  // Espressif
    0x1B4F,  // SparkFun
    0x1A86,  // QinHeng: the CH340 of cheap boards
};

/// Result of a driver's own thread, which may outlive the one that waits.
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

std::vector<FoundPort> list_ports(const Machine& machine) {
  constexpr const char* kLinks = "/dev/serial/by-id/";
  std::vector<FoundPort> ports;
  for (SerialPortInfo& info : list_serial_ports()) {
    FoundPort p;
    p.kind = serial_kind(info.usb_vendor, info.usb_product);
    for (const std::string& name : machine.names(kLinks))
      if (machine.target(kLinks + name) == info.port) p.by_id = kLinks + name;
    p.info = std::move(info);
    if (p.kind == SerialKind::ins) p.configuration = "ins: {driver: xsens, port: " + p.name() + "}";
    ports.push_back(std::move(p));
  }
  return ports;
}

}  // namespace

std::string UsbDevice::node() const { return fmt::format("/dev/bus/usb/{:03}/{:03}", bus, number); }

std::vector<UsbDevice> list_usb_devices(const Machine& m) {
  const std::string devices = "/sys/bus/usb/devices/";
  const auto small_number = [&m](const std::string& path) {
    const std::int64_t n = m.number(path).value_or(0);
    return n > 0 && n < 1000 ? static_cast<int>(n) : 0;
  };
  std::vector<UsbDevice> all;
  for (const std::string& name : m.names(devices)) {
    // usb1 is a root hub, 1-2:1.0 an interface of 1-2.
    if (name.find(':') != std::string::npos || name.find('-') == std::string::npos) continue;
    const std::string folder = devices + name;
    const auto vendor = m.number(folder + "/idVendor", 16),
               product = m.number(folder + "/idProduct", 16);
    if (!vendor || !product || *vendor < 0 || *vendor > 0xFFFF || *product < 0 || *product > 0xFFFF)
      continue;
    UsbDevice d;
    d.port = name;
    d.vendor = static_cast<std::uint16_t>(*vendor);
    d.product = static_cast<std::uint16_t>(*product);
    d.serial = m.line(folder + "/serial").value_or("");
    const std::string maker = m.line(folder + "/manufacturer").value_or(""),
                      title = m.line(folder + "/product").value_or("");
    d.title = title.starts_with(maker) ? title : title.empty() ? maker : maker + " " + title;
    d.bus = small_number(folder + "/busnum");
    d.number = small_number(folder + "/devnum");
    for (const std::string& entry : m.names(folder))
      if (entry.starts_with(name + ":"))
        for (std::string& node : m.names(fmt::format("{}/{}/video4linux", folder, entry)))
          d.video.push_back(std::move(node));
    all.push_back(std::move(d));
  }
  return all;
}

const char* to_string(SerialKind kind) noexcept {
  constexpr std::array kKeys{"ins", "ftdi", "converter", "board", "built_in", "unknown"};
  return kKeys.at(static_cast<std::size_t>(kind));
}

SerialKind serial_kind(std::uint16_t vendor, std::uint16_t product) noexcept {
  if (vendor == 0) return SerialKind::built_in;
  // XSens' products under FTDI's vendor id, as in udev/99-vergence.rules.
  const bool xsens = vendor == kFtdi && product >= 0xD388 && product <= 0xD38F;
  if (vendor == kXsens || xsens) return SerialKind::ins;
  if (vendor == kFtdi) return SerialKind::ftdi;
  if (vendor == 0x10C4 || vendor == 0x067B) return SerialKind::converter;  // Silicon Labs, Prolific
  if (std::find(kBoardVendors.begin(), kBoardVendors.end(), vendor) != kBoardVendors.end())
    return SerialKind::board;
  return SerialKind::unknown;
}

bool is_ftdi(std::uint16_t vendor, std::uint16_t product) noexcept {
  return vendor == kFtdi ||
         (vendor == kXsens && (product == 0x0300 || product == 0x0301 || product == 0xD00D));
}

bool names_port(const Machine& machine, const std::string& key, const FoundPort& port) {
  if (key.empty()) return port.info.usb_vendor != 0;
  const std::string& serial = port.info.usb_serial;
  return key == port.by_id || machine.target(key) == port.info.port ||
         "/dev/" + key == port.info.port || (!serial.empty() && key == serial);
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

  const auto until =
      std::chrono::steady_clock::now() + std::chrono::nanoseconds(options.limit.ns());
  for (const auto& [row, search] : searches) {
    DriverFindings d{row->name, row->meaning, true, {}, {}};
    std::unique_lock lock(search->mutex);
    d.answered = search->changed.wait_until(lock, until, [&s = *search] { return s.done; });
    if (d.answered) {
      d.cameras = search->found;
      d.note = search->note;
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

std::string camera_line(const DeviceInfo& info) {
  const std::string& name = info.serial.empty() && info.driver == "gige" ? info.place : info.serial;
  // A JSON string is a YAML one, whatever the device says of itself.
  return fmt::format(
      "{{driver: {}, serial: {}}}", info.driver,
      nlohmann::json(name).dump(-1, ' ', true, nlohmann::json::error_handler_t::replace));
}

}  // namespace vergence::app
