#include "app/devices/doctor_checks.hpp"

#include <arpa/inet.h>
#include <linux/capability.h>
#include <strings.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <optional>
#include <set>

#include <fmt/format.h>

#include "app/devices/rig_settings.hpp"

namespace vergence::app {

namespace {

/// Bytes of a pixel on its way, by the name of its format; where the driver chooses, what it
/// chooses first.
double bytes_per_pixel(const CameraSettings& s) {
  const std::string& f = s.pixel_format;
  const auto has = [&f](const char* part) { return f.find(part) != std::string::npos; };
  if (f.empty())
    // Cameras of the USB video class send YUYV.
    return s.driver == "v4l2" ? 2 : 1;
  if (has("10P") || has("10p")) return 1.25;
  if (has("422") || has("YU") || has("VY") || has("16") || has("14") || has("12") || has("10"))
    return 2;
  if (has("RGB8") || has("444")) return 3;
  return 1;
}

}  // namespace

const char* to_string(FindingState state) noexcept {
  constexpr std::array kNames{"ok", "advice", "problem"};
  return kNames.at(static_cast<std::size_t>(state));
}

const Configuration& CheckContext::needs() const {
  static const Configuration kNothing;
  return drive != nullptr ? *drive : kNothing;
}

bool is_real_driver(const std::string& driver) {
  return !driver.empty() && driver != "none" && driver != "mock";
}

std::vector<Finding> run_checks(const CheckContext& context) {
  std::vector<Finding> findings;
  for (const auto check : {check_devices, check_network, check_system}) check(context, &findings);
  std::stable_sort(findings.begin(), findings.end(),
                   [](const Finding& a, const Finding& b) { return a.state > b.state; });
  return findings;
}

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
std::string format_list(const DriverFindings* d) {
  if (d == nullptr) return "no such driver";
  if (d->cameras.empty())
    return d->explanation.empty() ? "none found" : "none found: " + d->explanation;
  std::vector<std::string> names;
  for (const DeviceInfo& c : d->cameras) names.push_back(c.serial.empty() ? c.place : c.serial);
  return fmt::format("found: {}", fmt::join(names, ", "));
}

void check_cameras(const CheckContext& p, std::vector<Finding>* findings) {
  for (const DriverFindings& d : p.inventory.drivers)
    if (!d.answered)
      findings->push_back({"cameras",
                           FindingState::problem,
                           d.name + ": " + d.explanation,
                           {"sudo dmesg | tail -30"}});
  const auto matched = match_cameras(p);
  std::vector<std::string> present;
  for (std::size_t k = 0; k < matched.size(); ++k) {
    const CameraSettings& n = p.needs().cameras[k];
    if (n.driver == "mock") continue;
    const std::string who =
        fmt::format("cameras.{}{}", k, n.name.empty() ? "" : " (" + n.name + ")");
    if (matched[k] != nullptr)
      present.push_back(fmt::format("{} is {} {}", who, n.driver, matched[k]->serial));
    else if (n.driver == "gige" && std::count(n.serial.begin(), n.serial.end(), '.') == 3)
      findings->push_back({"cameras",
                           FindingState::advice,
                           who + ": no camera at " + n.serial +
                               " answers a broadcast; this is normal behind a router, else check "
                               "cable, power and address",
                           {"ping -c 3 " + n.serial}});
    else
      findings->push_back({"cameras",
                           FindingState::problem,
                           fmt::format("{}: the {} camera{} was not found ({}); check cable, power "
                                       "and serial",
                                       who, n.driver, n.serial.empty() ? "" : " " + n.serial,
                                       format_list(find_driver(p.inventory, n.driver))),
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
      o.check, FindingState::ok, fmt::format("{} can be opened", fmt::join(o.nodes, ", ")), {}};
  if (!closed.empty()) {
    f.state = FindingState::problem;
    f.message = fmt::format("{} cannot be opened: ", fmt::join(closed, ", "));
    const bool of_group = std::all_of(closed.begin(), closed.end(), [&](const std::string& node) {
      return p.machine.group_of(node) == o.group;
    });
    if (!of_group || p.machine.in_group(o.group)) {
      f.message += fmt::format(
          "group {} has no access (mode 0660); install the udev rules, or stop a serial console "
          "that uses the port (sudo systemctl mask --now serial-getty@NAME)",
          o.group);
      f.fix = kInstallRules;
    } else {
      f.message += fmt::format("{} is not in group {}; add the user, then log out and in again",
                               p.machine.user, o.group);
      f.fix = {fmt::format("sudo usermod -aG {} {}", o.group, p.machine.user)};
    }
  }
  findings->push_back(std::move(f));
}

/// Nodes of everything that looks like a camera of a kind that is asked for; without a
/// configuration of every kind.
std::vector<std::string> camera_nodes(const CheckContext& p) {
  const auto asked = [&p](const char* driver) {
    const auto& cameras = p.needs().cameras;
    return p.drive == nullptr || std::any_of(cameras.begin(), cameras.end(),
                                             [&](const auto& c) { return c.driver == driver; });
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
std::vector<const FoundPort*> find_ports(const CheckContext& p, bool ins, bool trigger) {
  const Configuration& n = p.needs();
  std::vector<const FoundPort*> some;
  for (const FoundPort& port : p.inventory.ports)
    if (p.drive != nullptr
            ? (ins && is_real_driver(n.ins.driver) && names_port(p.machine, n.ins.port, port)) ||
                  (trigger && is_real_driver(n.trigger.driver) &&
                   names_port(p.machine, n.trigger.port, port))
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
                         fmt::format("{}.port: {}: {} serial ports match, one is needed; set one "
                                     "that `vergence devices` lists",
                                     group, key.empty() ? "empty" : key, meant),
                         {}});
}

void check_serial_permission(const CheckContext& p, std::vector<Finding>* findings) {
  std::set<std::string> nodes;
  for (const FoundPort* port : find_ports(p, true, true)) nodes.insert(port->info.port);
  // A port that the list lacks, for instance of the board itself, is checked all the same.
  const auto add = [&](const std::string& driver, const std::string& port) {
    if (is_real_driver(driver) && port.starts_with("/") && p.machine.exists(port))
      nodes.insert(p.machine.target(port));
  };
  add(p.needs().ins.driver, p.needs().ins.port);
  add(p.needs().trigger.driver, p.needs().trigger.port);
  check_nodes(p, {"serial_permission", "dialout", {nodes.begin(), nodes.end()}}, findings);
}

void check_latency(const CheckContext& p, std::vector<Finding>* findings) {
  // Recommended latency in ms, see docs/ins.md.
  constexpr int kAdvisedLatency = 16;
  for (const FoundPort* port : find_ports(p, true, false)) {
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
      f.fix = {
          fmt::format("echo {} | sudo tee /sys/bus/usb-serial/devices/{}/latency_timer",
                      kAdvisedLatency, std::filesystem::path(port->info.port).filename().string()),
          kInstallRules.front()};
    }
    findings->push_back(std::move(f));
  }
}

}  // namespace

std::vector<const DeviceInfo*> match_cameras(const CheckContext& p) {
  std::vector<const DeviceInfo*> matched(static_cast<std::size_t>(camera_count(p.needs())),
                                         nullptr);
  // Entries that name a camera come first; the others take what is left.
  for (const bool named : {true, false})
    for (std::size_t k = 0; k < matched.size(); ++k) {
      const CameraSettings& n = p.needs().cameras[k];
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
  check_port(p, "ins", p.needs().ins.driver, p.needs().ins.port, findings);
  check_port(p, "trigger", p.needs().trigger.driver, p.needs().trigger.port, findings);
  check_serial_permission(p, findings);
  check_latency(p, findings);
}

namespace {

// As the driver asks for its sockets: eight images, 4 MiB at least; with less than two, images are
// lost.
constexpr double kBufferedImages = 8, kMinImages = 2;
constexpr std::int64_t kMinBuffer = std::int64_t{4} << 20;
constexpr std::int64_t kRecommendedBuffer = 10'485'760;
// Packet sizes in bytes.
constexpr int kJumbo = 9000, kStandard = 1500;

std::optional<std::uint32_t> ipv4(const std::string& text) {
  in_addr a{};
  if (::inet_pton(AF_INET, text.c_str(), &a) != 1) return std::nullopt;
  return ntohl(a.s_addr);
}

std::string dotted(std::uint32_t a) {
  return fmt::format("{}.{}.{}.{}", a >> 24U, a >> 16U & 255U, a >> 8U & 255U, a & 255U);
}

/// The interface through which an address is reached: the longest mask that fits.
const InterfaceAddress* way_to(const Machine& m, std::uint32_t address) {
  const InterfaceAddress* best = nullptr;
  for (const InterfaceAddress& a : m.addresses)
    if (((a.address ^ address) & a.mask) == 0 && (best == nullptr || a.mask > best->mask))
      best = &a;
  return best;
}

/// A camera and the way to it.
struct Reached {
  // Address of the camera.
  std::string place;
  // True if the camera answered the broadcast.
  bool found = false;
  // Null if the camera is in no network of this host.
  const InterfaceAddress* through = nullptr;
};

std::vector<Reached> gige_cameras(const CheckContext& p) {
  std::vector<Reached> all;
  for (const DriverFindings& d : p.inventory.drivers)
    for (const DeviceInfo& c : d.cameras)
      if (d.name == "gige") all.push_back({c.place, true, nullptr});
  // A camera that is configured by its address need not answer a broadcast.
  const auto matched = match_cameras(p);
  for (std::size_t k = 0; k < matched.size(); ++k)
    if (matched[k] == nullptr && p.needs().cameras[k].driver == "gige")
      all.push_back({p.needs().cameras[k].serial, false, nullptr});
  for (Reached& r : all)
    if (const auto address = ipv4(r.place)) r.through = way_to(p.machine, *address);
  return all;
}

void check_receive_buffer(const CheckContext& p, std::vector<Finding>* findings) {
  const auto limit = p.machine.number("/proc/sys/net/core/rmem_max");
  if (!limit) return;
  double image = 0;
  for (const CameraSettings& c : p.needs().cameras)
    if (c.driver == "gige") image = std::max(image, bytes_per_pixel(c) * c.width * c.height);
  const auto requested = std::max(kMinBuffer, static_cast<std::int64_t>(kBufferedImages * image));
  const std::int64_t advised = std::max(kRecommendedBuffer, requested);
  Finding f{
      "receive_buffer",
      FindingState::ok,
      fmt::format("net.core.rmem_max is {} KiB; the receive buffer of a GigE camera needs {} KiB",
                  *limit / 1024, requested / 1024),
      {}};
  if (*limit < requested && !p.machine.has_capability(CAP_NET_ADMIN)) {
    const bool lost = static_cast<double>(*limit) < kMinImages * image;
    f.state = lost ? FindingState::problem : FindingState::advice;
    if (lost) f.message += ": images will be lost";
    // The last file by name counts, and the package's own is 10-vergence.conf.
    f.fix = {fmt::format("sudo sysctl -w net.core.rmem_max={}", advised),
             fmt::format("echo net.core.rmem_max={} | sudo tee /etc/sysctl.d/90-vergence-rmem.conf",
                         advised)};
  }
  findings->push_back(std::move(f));
}

void check_reach(const std::vector<Reached>& cameras, std::vector<Finding>* findings) {
  std::vector<std::string> reached;
  for (const Reached& r : cameras) {
    const auto address = ipv4(r.place);
    if (!address) continue;
    if (r.through != nullptr) {
      reached.push_back(r.place + " through " + r.through->name);
      continue;
    }
    const bool link_local = *address >> 16U == 0xA9FEU;
    const std::uint32_t own = (*address & ~255U) | ((*address & 255U) == 1 ? 2U : 1U);
    findings->push_back(
        {"camera_network",
         r.found ? FindingState::problem : FindingState::advice,
         fmt::format("the camera at {} is not in a network of this host: it {}", r.place,
                     r.found ? "answers only broadcasts" : "may be reachable through a router"),
         {fmt::format("sudo ip addr add {}/{} dev INTERFACE", dotted(own), link_local ? 16 : 24)}});
  }
  if (!reached.empty())
    findings->push_back(
        {"camera_network", FindingState::ok, fmt::format("{}", fmt::join(reached, ", ")), {}});
}

void check_mtu(const std::string& name, int mtu, std::vector<Finding>* findings) {
  Finding f{"mtu", FindingState::ok, fmt::format("{} has an MTU of {}", name, mtu), {}};
  if (mtu < kJumbo) {
    f.state = FindingState::advice;
    f.message += fmt::format(
        "; with {} (on the interface and every switch) a camera needs a quarter of the CPU time",
        kJumbo);
    f.fix = {fmt::format("sudo ip link set dev {} mtu {}", name, kJumbo),
             fmt::format("sudo nmcli con mod {} 802-3-ethernet.mtu {}", name, kJumbo)};
  }
  findings->push_back(std::move(f));
}

}  // namespace

void check_network(const CheckContext& p, std::vector<Finding>* findings) {
  const std::vector<Reached> cameras = gige_cameras(p);
  if (cameras.empty()) return;
  check_receive_buffer(p, findings);
  check_reach(cameras, findings);
  std::set<std::string> links;
  for (const Reached& r : cameras)
    if (r.through != nullptr) links.insert(r.through->name);
  for (const std::string& name : links) {
    const auto mtu = p.machine.number("/sys/class/net/" + name + "/mtu").value_or(kStandard);
    check_mtu(name, static_cast<int>(std::clamp<std::int64_t>(mtu, 68, 65536)), findings);
  }
}

namespace {

/// Limits of this process, where threads or memory ask for them.
void check_limits(const CheckContext& p, std::vector<Finding>* findings) {
  // Locked memory in bytes that two cameras and the threads need.
  constexpr std::int64_t kLockedMemory = std::int64_t{512} << 20;
  struct Limit {
    const char* check;
    const char* key;
    // Name of the limit in /proc/self/limits.
    const char* name;
    unsigned capability;
    // 0 if the limit is not checked.
    std::int64_t wanted;
    FindingState refused;
    std::string item;
  };
  const int priority = p.needs().realtime.priority;
  const std::array limits{
      Limit{"realtime", "realtime.priority", "Max realtime priority", CAP_SYS_NICE, priority,
            FindingState::problem, fmt::format("rtprio {}", std::max(20, priority))},
      Limit{"memory_lock", "realtime.lock_memory", "Max locked memory", CAP_IPC_LOCK,
            p.needs().realtime.lock_memory != 0 ? kLockedMemory : 0, FindingState::advice,
            "memlock unlimited"}};
  for (const Limit& l : limits) {
    const auto limit = p.machine.limit(l.name);
    if (l.wanted <= 0 || !limit) continue;
    const bool enough = *limit < 0 || *limit >= l.wanted || p.machine.has_capability(l.capability);
    Finding f{l.check,
              FindingState::ok,
              fmt::format("{} needs a limit of {}, {} has {}", l.key, l.wanted, p.machine.user,
                          *limit < 0 ? "none" : std::to_string(*limit)),
              {}};
    if (!enough) {
      f.state = l.refused;
      f.fix = {fmt::format("echo '{} - {}' | sudo tee -a /etc/security/limits.d/60-vergence.conf",
                           p.machine.user, l.item)};
    }
    findings->push_back(std::move(f));
  }
}

void check_clock(const CheckContext& p, std::vector<Finding>* findings) {
  Finding f{"clock", FindingState::ok, "the system clock is synchronised", {}};
  if (!p.machine.clock_synchronised.value_or(false)) {
    f.state = FindingState::advice;
    f.message =
        "the system clock is not synchronised: session dates may be wrong; intervals are correct";
    // Without a clock with a battery a start begins with an old date; timesyncd remembers the last.
    f.fix = {p.machine.exists("/dev/rtc0") ? "sudo apt-get install chrony"
                                           : "sudo apt-get install systemd-timesyncd"};
  }
  findings->push_back(std::move(f));
}

void check_disk(const CheckContext& p, std::vector<Finding>* findings) {
  constexpr std::uint64_t kMin = std::uint64_t{200} << 20, kComfortable = std::uint64_t{2} << 30;
  const auto room = p.machine.room_at(p.out);
  if (!room) return;
  const std::string where = p.out == "." ? "the current directory" : p.out.string();
  Finding f{"disk",
            FindingState::ok,
            fmt::format("{:.1f} GB are free in {}", static_cast<double>(room->bytes) / 1e9, where),
            {}};
  if (room->read_only) {
    f.state = FindingState::problem;
    f.message = fmt::format("the file system of {} is read-only: no session can be written", where);
    f.fix = {fmt::format("findmnt -T '{}'", p.out.string())};
  } else if (!room->may_write && p.drive != nullptr) {
    f.state = FindingState::problem;
    f.message = fmt::format("{} cannot write to {}; use a directory of your own with --out",
                            p.machine.user, where);
  } else if (room->bytes < kComfortable) {
    f.state = room->bytes < kMin ? FindingState::problem : FindingState::advice;
    f.message += "; an hour needs about 100 MB, recordings of images much more";
    f.fix = {"df -h"};
  }
  findings->push_back(std::move(f));
}

}  // namespace

void check_system(const CheckContext& p, std::vector<Finding>* findings) {
  check_limits(p, findings);
  check_clock(p, findings);
  check_disk(p, findings);
}

}  // namespace vergence::app
