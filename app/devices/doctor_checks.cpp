#include "app/devices/doctor_checks.hpp"

#include <arpa/inet.h>
#include <linux/capability.h>
#include <strings.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <set>
#include <utility>

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

/// Nodes of everything that looks like a camera of a kind that is asked for; without a
/// configuration of every kind.
std::vector<std::string> camera_nodes(const CheckContext& p) {
  const auto asked = [&p](const char* driver) {
    const auto& cameras = p.needs().cameras;
    return p.drive == nullptr ||
           std::ranges::any_of(cameras, [&](const auto& c) { return c.driver == driver; });
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

/// Serial ports that matter: those of the configuration, with `trigger` also that of the trigger
/// board, without one all on USB.
std::vector<const FoundPort*> find_ports(const CheckContext& p, bool trigger) {
  const Configuration& n = p.needs();
  std::vector<const FoundPort*> some;
  for (const FoundPort& port : p.inventory.ports)
    if (p.drive != nullptr
            ? (is_real_driver(n.ins.driver) && names_port(p.machine, n.ins.port, port)) ||
                  (trigger && is_real_driver(n.trigger.driver) &&
                   names_port(p.machine, n.trigger.port, port))
            : port.info.usb_vendor != 0)
      some.push_back(&port);
  return some;
}

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

/// The checks of a context; each appends its findings in any order.
class Checks {
 public:
  explicit Checks(const CheckContext& context) : p_(context) {
    check_cameras();
    check_nodes("camera_permission", "video", camera_nodes(p_));
    check_port("ins", p_.needs().ins.driver, p_.needs().ins.port);
    check_port("trigger", p_.needs().trigger.driver, p_.needs().trigger.port);
    check_serial_permission();
    check_latency();
    check_network();
    check_limits();
    check_clock();
    check_disk();
  }
  [[nodiscard]] std::vector<Finding>& findings() noexcept { return findings_; }

 private:
  void add(const char* check, FindingState state, std::string message,
           std::vector<std::string> fix = {}) {
    findings_.push_back({check, state, std::move(message), std::move(fix)});
  }

  void check_cameras() {
    for (const DriverFindings& d : p_.inventory.drivers)
      if (!d.answered)
        add("cameras", FindingState::problem, d.name + ": " + d.explanation,
            {"sudo dmesg | tail -30"});
    const auto matched = match_cameras(p_);
    std::vector<std::string> present;
    for (std::size_t k = 0; k < matched.size(); ++k) {
      const CameraSettings& n = p_.needs().cameras[k];
      if (n.driver == "mock") continue;
      const std::string who =
          fmt::format("cameras.{}{}", k, n.name.empty() ? "" : " (" + n.name + ")");
      if (matched[k] != nullptr)
        present.push_back(fmt::format("{} is {} {}", who, n.driver, matched[k]->serial));
      else if (n.driver == "gige" && std::ranges::count(n.serial, '.') == 3)
        add("cameras", FindingState::advice,
            who + ": no camera at " + n.serial +
                " responds to a broadcast; this is normal behind a router, else check cable, power "
                "and address",
            {"ping -c 3 " + n.serial});
      else
        add("cameras", FindingState::problem,
            fmt::format("{}: the {} camera{} was not found ({}); check cable, power and serial",
                        who, n.driver, n.serial.empty() ? "" : " " + n.serial,
                        format_list(find_driver(p_.inventory, n.driver))));
    }
    if (!present.empty())
      add("cameras", FindingState::ok, fmt::format("{}", fmt::join(present, ", ")));
  }

  /// Checks that this user may read and write the nodes, which `group` should own; if not, the
  /// cause is another login, membership, or a rule that gives the node to the group.
  void check_nodes(const char* check, const char* group, const std::vector<std::string>& nodes) {
    std::vector<std::string> closed;
    std::ranges::copy_if(nodes, std::back_inserter(closed),
                         [&](const std::string& node) { return !p_.machine.may_use(node); });
    if (nodes.empty()) return;
    if (closed.empty())
      return add(check, FindingState::ok, fmt::format("{} can be opened", fmt::join(nodes, ", ")));
    const std::string message = fmt::format("{} cannot be opened: ", fmt::join(closed, ", "));
    const bool of_group = std::ranges::all_of(
        closed, [&](const std::string& node) { return p_.machine.group_of(node) == group; });
    if (!of_group || p_.machine.in_group(group))
      return add(check, FindingState::problem,
                 fmt::format("{}group {} has no access (mode 0660); install the udev rules, or "
                             "stop a serial console that uses the port (sudo systemctl mask --now "
                             "serial-getty@NAME)",
                             message, group),
                 kInstallRules);
    add(check, FindingState::problem,
        fmt::format("{}{} is not in group {}; add the user, then log out and in again", message,
                    p_.machine.user, group),
        {fmt::format("sudo usermod -aG {} {}", group, p_.machine.user)});
  }

  /// The configuration means one serial port that is there.
  void check_port(const char* group, const std::string& driver, const std::string& key) {
    if (!is_real_driver(driver) || (!key.empty() && p_.machine.exists(key))) return;
    const auto meant = std::ranges::count_if(
        p_.inventory.ports, [&](const auto& f) { return names_port(p_.machine, key, f); });
    if (meant == 0 || (meant > 1 && group == std::string_view("ins")))
      add(group, FindingState::problem,
          fmt::format("{}.port: {}: {} serial ports match, one is needed; set one that `vergence "
                      "devices` lists",
                      group, key.empty() ? "empty" : key, meant));
  }

  void check_serial_permission() {
    std::set<std::string> nodes;
    for (const FoundPort* port : find_ports(p_, true)) nodes.insert(port->info.port);
    // A port that the list lacks, for instance of the board itself, is checked all the same.
    const auto add_port = [&](const std::string& driver, const std::string& port) {
      if (is_real_driver(driver) && port.starts_with("/") && p_.machine.exists(port))
        nodes.insert(p_.machine.target(port));
    };
    add_port(p_.needs().ins.driver, p_.needs().ins.port);
    add_port(p_.needs().trigger.driver, p_.needs().trigger.port);
    check_nodes("serial_permission", "dialout", {nodes.begin(), nodes.end()});
  }

  void check_latency() {
    // Recommended latency in ms, see docs/ins.md.
    constexpr int kAdvised = 16;
    for (const FoundPort* port : find_ports(p_, false)) {
      const bool ins = port->kind == SerialKind::ins || port->kind == SerialKind::ftdi;
      if (!port->info.latency_timer_ms || !ins) continue;
      const int ms = *port->info.latency_timer_ms;
      const std::string message =
          fmt::format("{}: the converter's latency timer is {} ms", port->info.port, ms);
      if (ms == kAdvised)
        add("latency_timer", FindingState::ok, message);
      else
        add("latency_timer", FindingState::advice,
            fmt::format("{}; the INS's stamps are best with {} ms (docs/ins.md)", message,
                        kAdvised),
            {fmt::format("echo {} | sudo tee /sys/bus/usb-serial/devices/{}/latency_timer",
                         kAdvised, std::filesystem::path(port->info.port).filename().string()),
             kInstallRules.front()});
    }
  }

  void check_receive_buffer() {
    const auto limit = p_.machine.number("/proc/sys/net/core/rmem_max");
    if (!limit) return;
    double image = 0;
    for (const CameraSettings& c : p_.needs().cameras)
      if (c.driver == "gige") image = std::max(image, bytes_per_pixel(c) * c.width * c.height);
    const auto requested = std::max(kMinBuffer, static_cast<std::int64_t>(kBufferedImages * image));
    const std::int64_t advised = std::max(kRecommendedBuffer, requested);
    const std::string message =
        fmt::format("net.core.rmem_max is {} KiB; the receive buffer of a GigE camera needs {} KiB",
                    *limit / 1024, requested / 1024);
    if (*limit >= requested || p_.machine.has_capability(CAP_NET_ADMIN))
      return add("receive_buffer", FindingState::ok, message);
    const bool lost = static_cast<double>(*limit) < kMinImages * image;
    // The last file by name counts, and the package's own is 10-vergence.conf.
    add("receive_buffer", lost ? FindingState::problem : FindingState::advice,
        lost ? message + ": images will be lost" : message,
        {fmt::format("sudo sysctl -w net.core.rmem_max={}", advised),
         fmt::format("echo net.core.rmem_max={} | sudo tee /etc/sysctl.d/90-vergence-rmem.conf",
                     advised)});
  }

  void check_reach(const std::vector<Reached>& cameras) {
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
      add("camera_network", r.found ? FindingState::problem : FindingState::advice,
          fmt::format("the camera at {} is not in a network of this host: it {}", r.place,
                      r.found ? "answers only broadcasts" : "may be reachable through a router"),
          {fmt::format("sudo ip addr add {}/{} dev INTERFACE", dotted(own), link_local ? 16 : 24)});
    }
    if (!reached.empty())
      add("camera_network", FindingState::ok, fmt::format("{}", fmt::join(reached, ", ")));
  }

  void check_mtu(const std::string& name) {
    const auto read = p_.machine.number("/sys/class/net/" + name + "/mtu").value_or(kStandard);
    const auto mtu = std::clamp<std::int64_t>(read, 68, 65536);
    const std::string message = fmt::format("{} has an MTU of {}", name, mtu);
    if (mtu >= kJumbo) return add("mtu", FindingState::ok, message);
    add("mtu", FindingState::advice,
        fmt::format("{}; with {} (on the interface and every switch) a camera needs a quarter of "
                    "the CPU time",
                    message, kJumbo),
        {fmt::format("sudo ip link set dev {} mtu {}", name, kJumbo),
         fmt::format("sudo nmcli con mod {} 802-3-ethernet.mtu {}", name, kJumbo)});
  }

  /// Checks the network for GigE Vision cameras.
  void check_network() {
    const std::vector<Reached> cameras = gige_cameras(p_);
    if (cameras.empty()) return;
    check_receive_buffer();
    check_reach(cameras);
    std::set<std::string> links;
    for (const Reached& r : cameras)
      if (r.through != nullptr) links.insert(r.through->name);
    for (const std::string& name : links) check_mtu(name);
  }

  /// Checks a limit of this process, where threads or memory ask for it. `name` is that in
  /// /proc/self/limits, `item` is the line of limits.conf.
  void check_limit(const char* check, const char* key, const char* name, unsigned capability,
                   std::int64_t wanted, FindingState refused, const std::string& item) {
    const auto limit = p_.machine.limit(name);
    if (wanted <= 0 || !limit) return;
    const std::string message =
        fmt::format("{} needs a limit of {}, {} has {}", key, wanted, p_.machine.user,
                    *limit < 0 ? "none" : std::to_string(*limit));
    if (*limit < 0 || *limit >= wanted || p_.machine.has_capability(capability))
      add(check, FindingState::ok, message);
    else
      add(check, refused, message,
          {fmt::format("echo '{} - {}' | sudo tee -a /etc/security/limits.d/60-vergence.conf",
                       p_.machine.user, item)});
  }

  void check_limits() {
    // Locked memory in bytes that two cameras and the threads need.
    constexpr std::int64_t kLockedMemory = std::int64_t{512} << 20;
    const int priority = p_.needs().realtime.priority;
    check_limit("realtime", "realtime.priority", "Max realtime priority", CAP_SYS_NICE, priority,
                FindingState::problem, fmt::format("rtprio {}", std::max(20, priority)));
    check_limit("memory_lock", "realtime.lock_memory", "Max locked memory", CAP_IPC_LOCK,
                p_.needs().realtime.lock_memory != 0 ? kLockedMemory : 0, FindingState::advice,
                "memlock unlimited");
  }

  void check_clock() {
    if (p_.machine.clock_synchronised.value_or(false))
      return add("clock", FindingState::ok, "the system clock is synchronised");
    // Without a clock with a battery a start begins with an old date; timesyncd remembers the last.
    add("clock", FindingState::advice,
        "the system clock is not synchronised: session dates may be wrong; intervals are correct",
        {p_.machine.exists("/dev/rtc0") ? "sudo apt-get install chrony"
                                        : "sudo apt-get install systemd-timesyncd"});
  }

  void check_disk() {
    constexpr std::uint64_t kMin = std::uint64_t{200} << 20, kComfortable = std::uint64_t{2} << 30;
    const auto room = p_.machine.room_at(p_.out);
    if (!room) return;
    const std::string where = p_.out == "." ? "the current directory" : p_.out.string();
    const std::string free =
        fmt::format("{:.1f} GB are free in {}", static_cast<double>(room->bytes) / 1e9, where);
    if (room->read_only)
      add("disk", FindingState::problem,
          fmt::format("the file system of {} is read-only: no session can be written", where),
          {fmt::format("findmnt -T '{}'", p_.out.string())});
    else if (!room->may_write && p_.drive != nullptr)
      add("disk", FindingState::problem,
          fmt::format("{} cannot write to {}; use a directory of your own with --out",
                      p_.machine.user, where));
    else if (room->bytes < kComfortable)
      add("disk", room->bytes < kMin ? FindingState::problem : FindingState::advice,
          free + "; an hour needs about 100 MB, recordings of images much more", {"df -h"});
    else
      add("disk", FindingState::ok, free);
  }

  const CheckContext& p_;
  std::vector<Finding> findings_{};
};

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
        if (std::ranges::find(matched, &c) == matched.end() &&
            (!named || means(p.machine, n.serial, c))) {
          matched[k] = &c;
          break;
        }
    }
  return matched;
}

std::vector<Finding> run_checks(const CheckContext& context) {
  std::vector<Finding> findings = std::move(Checks(context).findings());
  std::ranges::stable_sort(findings, std::greater<>(), &Finding::state);
  return findings;
}

}  // namespace vergence::app
