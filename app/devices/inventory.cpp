#include "app/devices/inventory.hpp"

#include <arpa/inet.h>
#include <grp.h>
#include <ifaddrs.h>
#include <netinet/in.h>
#include <pwd.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <sys/timex.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <exception>
#include <fstream>
#include <future>
#include <sstream>
#include <system_error>
#include <thread>

#include <nlohmann/json.hpp>

#include "app/datasets/text_file.hpp"
#include "app/devices/camera_drivers.hpp"

namespace vergence::app {

namespace fs = std::filesystem;
namespace {

template <class Integer>
std::optional<Integer> whole_number(const std::optional<std::string>& text, int base) {
  Integer value{};
  return text && parse_whole(*text, &value, base) ? std::optional(value) : std::nullopt;
}

/// Empty: there is none. Not thread-safe, as getgrgid().
std::string group_name(gid_t id) {
  const ::group* found = ::getgrgid(id);
  return found == nullptr ? std::string() : found->gr_name;
}

std::vector<std::string> own_groups() {
  std::vector<gid_t> ids(static_cast<std::size_t>(std::max(0, ::getgroups(0, nullptr))));
  (void)::getgroups(static_cast<int>(ids.size()), ids.data());
  ids.push_back(::getegid());
  std::vector<std::string> names;
  names.reserve(ids.size());
  for (const gid_t id : ids) names.push_back(group_name(id));
  return names;
}

std::vector<InterfaceAddress> own_addresses() {
  std::vector<InterfaceAddress> all;
  ifaddrs* list = nullptr;
  if (::getifaddrs(&list) != 0) return all;
  const auto host_order = [](const sockaddr* a) {
    sockaddr_in in{};
    if (a != nullptr) std::memcpy(&in, a, sizeof in);
    return ntohl(in.sin_addr.s_addr);
  };
  for (const ifaddrs* i = list; i != nullptr; i = i->ifa_next)
    if (i->ifa_addr != nullptr && i->ifa_addr->sa_family == AF_INET)
      all.push_back({i->ifa_name, host_order(i->ifa_addr), host_order(i->ifa_netmask)});
  ::freeifaddrs(list);
  return all;
}

std::string group_of_node(const std::string& node) {
  struct stat s {};
  if (::stat(node.c_str(), &s) != 0) return {};
  return group_name(s.st_gid);
}

std::optional<DiskRoom> disk_room(const fs::path& folder) {
  // The folder may still have to be made, or be closed to this user: what counts is the disk that
  // it will be on, by the first folder above it that tells.
  std::error_code error;
  fs::path at = fs::absolute(folder, error);
  if (error) return std::nullopt;
  struct statvfs s {};
  bool closed = false;
  while (::statvfs(at.c_str(), &s) != 0) {
    closed = closed || errno == EACCES;
    if (!at.has_relative_path()) return std::nullopt;
    at = at.parent_path();
  }
  return DiskRoom{.bytes = static_cast<std::uint64_t>(s.f_bavail) * s.f_frsize,
                  .read_only = (s.f_flag & ST_RDONLY) != 0,
                  .may_write = !closed && ::access(at.c_str(), W_OK | X_OK) == 0};
}

std::optional<bool> kernel_clock_synchronised() {
  timex t{};
  const int state = ::adjtimex(&t);
  if (state < 0) return std::nullopt;
  return state != TIME_ERROR && (t.status & STA_UNSYNC) == 0;
}

constexpr std::uint16_t kFtdi = 0x0403, kXsens = 0x2639;

/// Vendors of boards that bring USB with them, or a converter that hardly anything else has.
/// The entries are, in order, Arduino, the dog hunter fork of Arduino, Teensy (a shared vendor
/// identifier), Raspberry Pi (Pico), STMicroelectronics (virtual COM port, ST-Link), Adafruit,
/// Espressif, SparkFun and QinHeng (the CH340 of cheap trigger boards).
constexpr std::array<std::uint16_t, 9> kBoardVendors{0x2341, 0x2A03, 0x16C0, 0x2E8A, 0x0483,
                                                     0x239A, 0x303A, 0x1B4F, 0x1A86};

struct Search {
  std::vector<DeviceInfo> found;
  std::string explanation;
};

/// On a thread of the driver's own, which may outlive the one that waits.
std::future<Search> begin_search(const CameraDriverRow& row) {
  std::packaged_task<Search()> task([make = row.make]() -> Search {
    try {
      const auto driver = make();
      std::vector<DeviceInfo> found = driver->enumerate();
      return {std::move(found), driver->last_error()};
    } catch (const std::exception& e) {
      return {{}, std::string("the search failed: ") + e.what()};
    }
  });
  std::future<Search> search = task.get_future();
  std::thread(std::move(task)).detach();
  return search;
}

std::vector<FoundPort> list_ports(const Machine& machine) {
  constexpr const char* kLinks = "/dev/serial/by-id/";
  std::vector<FoundPort> ports;
  for (SerialPortInfo& info : list_serial_ports()) {
    FoundPort p{.kind = serial_kind(info.usb_vendor, info.usb_product)};
    for (const std::string& name : machine.names(kLinks))
      if (machine.target(kLinks + name) == info.port) p.by_id = kLinks + name;
    p.info = std::move(info);
    if (p.kind == SerialKind::ins) p.configuration = "ins: {driver: xsens, port: " + p.name() + "}";
    ports.push_back(std::move(p));
  }
  return ports;
}

}  // namespace

Machine Machine::here() {
  Machine m;
  if (const passwd* self = ::getpwuid(::getuid())) m.user = self->pw_name;
  m.groups = own_groups();
  m.addresses = own_addresses();
  m.may_use = [](const std::string& node) { return ::access(node.c_str(), R_OK | W_OK) == 0; };
  m.group_of = group_of_node;
  m.room_at = disk_room;
  m.clock_synchronised = kernel_clock_synchronised();
  return m;
}

std::optional<std::string> Machine::text(const std::string& path) const {
  std::error_code error;
  // Opening a pipe would block.
  if (!fs::is_regular_file(at(path), error)) return std::nullopt;
  std::ifstream in(at(path), std::ios::binary);
  std::string all(kMaxText, '\0');
  if (!in.read(all.data(), static_cast<std::streamsize>(all.size())) && !in.eof())
    return std::nullopt;
  all.resize(static_cast<std::size_t>(in.gcount()));
  return all;
}

std::optional<std::string> Machine::line(const std::string& path) const {
  const std::optional<std::string> all = text(path);
  if (!all) return std::nullopt;
  std::string first(trimmed(std::string_view(*all).substr(0, all->find('\n'))));
  std::ranges::replace_if(
      first, [](unsigned char c) { return c < 0x20 || c >= 0x7f; }, '?');
  return first;
}

std::optional<std::int64_t> Machine::number(const std::string& path, int base) const {
  return whole_number<std::int64_t>(line(path), base);
}

std::vector<std::string> Machine::names(const std::string& path) const {
  std::vector<std::string> all;
  std::error_code error;
  for (fs::directory_iterator it(at(path), error), end;
       !error && it != end && all.size() < kMaxNames; it.increment(error))
    all.push_back(it->path().filename().string());
  std::ranges::sort(all);
  return all;
}

bool Machine::exists(const std::string& path) const {
  std::error_code error;
  return fs::exists(at(path), error);
}

std::string Machine::target(const std::string& path) const {
  std::error_code error;
  const fs::path inside = fs::canonical(root, error);
  if (error) return path;
  const fs::path end = fs::canonical(at(path), error).lexically_relative(inside);
  if (error || end.empty() || *end.begin() == "..") return path;
  return (fs::path("/") / end).string();
}

bool Machine::has_capability(unsigned bit) const {
  const std::optional<std::string> status = text("/proc/self/status");
  if (!status || bit >= 64) return false;
  constexpr std::string_view kKey = "CapEff:";
  const auto where = status->find(kKey);
  if (where == std::string::npos) return false;
  const std::string_view rest = std::string_view(*status).substr(where + kKey.size());
  const std::string hex(trimmed(rest.substr(0, rest.find('\n'))));
  return (whole_number<std::uint64_t>(hex, 16).value_or(0) >> bit & 1U) != 0;
}

std::optional<std::int64_t> Machine::limit(const std::string& name) const {
  const std::optional<std::string> limits = text("/proc/self/limits");
  if (!limits) return std::nullopt;
  std::istringstream lines(*limits);
  for (std::string row; std::getline(lines, row);) {
    if (!row.starts_with(name)) continue;
    std::istringstream words(row.substr(name.size()));
    std::string soft;
    words >> soft;
    if (soft == "unlimited") return -1;
    return whole_number<std::int64_t>(soft, 10);
  }
  return std::nullopt;
}

bool Machine::in_group(const std::string& group) const {
  return std::ranges::find(groups, group) != groups.end();
}

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
    UsbDevice d{.port = name,
                .vendor = static_cast<std::uint16_t>(*vendor),
                .product = static_cast<std::uint16_t>(*product),
                .serial = m.line(folder + "/serial").value_or("")};
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
  // The vendors are Silicon Labs and Prolific.
  if (vendor == 0x10C4 || vendor == 0x067B) return SerialKind::converter;
  if (std::ranges::find(kBoardVendors, vendor) != kBoardVendors.end()) return SerialKind::board;
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

Inventory make_inventory(const Machine& machine, const InventoryOptions& options) {
  Inventory inventory;
  std::vector<std::pair<const CameraDriverRow*, std::future<Search>>> searches;
  for (const CameraDriverRow& row : camera_driver_rows())
    if (options.drivers.empty() ||
        std::ranges::find(options.drivers, row.name) != options.drivers.end())
      searches.emplace_back(&row, begin_search(row));
  inventory.usb = list_usb_devices(machine);
  inventory.firewire = iidc::list_firewire_cameras(machine.root / "sys");
  inventory.ports = list_ports(machine);

  const auto until =
      std::chrono::steady_clock::now() + std::chrono::nanoseconds(options.limit.ns());
  for (auto& [row, search] : searches) {
    DriverFindings d{row->name, row->meaning, true, {}, {}};
    d.answered = search.wait_until(until) == std::future_status::ready;
    if (d.answered) {
      Search found = search.get();
      d.cameras = std::move(found.found);
      d.explanation = std::move(found.explanation);
    } else {
      d.explanation = fmt::format(
          "no answer within {:.0f} s: a device or its kernel driver hangs; unplug it and check "
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
