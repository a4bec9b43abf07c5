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
    return s.driver == "v4l2" ? 2 : 1;  // YUYV is what cameras of the USB video class have
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
    return d->explanation.empty() ? "none is there" : "none is there: " + d->explanation;
  std::vector<std::string> names;
  for (const DeviceInfo& c : d->cameras) names.push_back(c.serial.empty() ? c.place : c.serial);
  return fmt::format("there: {}", fmt::join(names, ", "));
}

// As the driver asks for its sockets: eight images, 4 MiB at least; with less than two, images are
// lost.
constexpr double kBufferedImages = 8, kMinImages = 2;
constexpr std::int64_t kMinBuffer = std::int64_t{4} << 20;
constexpr std::int64_t kRecommendedBuffer = 10'485'760;
constexpr int kJumbo = 9000, kStandard = 1500;  // bytes

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
  std::string place;                          // its address
  bool found = false;                         // it answered the broadcast
  const InterfaceAddress* through = nullptr;  // null: in no network of this host
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
        if (std::find(matched.begin(), matched.end(), &c) == matched.end() &&
            (!named || means(p.machine, n.serial, c))) {
          matched[k] = &c;
          break;
        }
    }
  return matched;
}

namespace {

/// The checks; each appends its findings, with the commands that fix them.
class Doctor {
 public:
  explicit Doctor(const CheckContext& context)
      : machine_(context.machine),
        inventory_(context.inventory),
        needs_(context.needs()),
        given_(context.drive != nullptr),
        out_(context.out),
        matched_(match_cameras(context)) {}

  std::vector<Finding> examine() {
    check_cameras();
    check_nodes("camera_permission", "video", camera_nodes());
    check_port("ins", needs_.ins.driver, needs_.ins.port);
    check_port("trigger", needs_.trigger.driver, needs_.trigger.port);
    check_nodes("serial_permission", "dialout", serial_nodes());
    check_latency();
    check_network();
    check_disk();
    return std::move(findings_);
  }

 private:
  using Commands = std::vector<std::string>;

  void add(FindingState state, const char* check, std::string message, Commands fix = {}) {
    findings_.push_back({check, state, std::move(message), std::move(fix)});
  }
  void ok(const char* check, std::string message) {
    add(FindingState::ok, check, std::move(message));
  }
  void advise(const char* check, std::string message, Commands fix) {
    add(FindingState::advice, check, std::move(message), std::move(fix));
  }
  void problem(const char* check, std::string message, Commands fix = {}) {
    add(FindingState::problem, check, std::move(message), std::move(fix));
  }

  void check_cameras() {
    for (const DriverFindings& d : inventory_.drivers)
      if (!d.answered) problem("cameras", d.name + ": " + d.explanation, {"sudo dmesg | tail -30"});
    std::vector<std::string> present;
    for (std::size_t k = 0; k < matched_.size(); ++k) {
      const CameraSettings& n = needs_.cameras[k];
      if (n.driver == "mock") continue;
      const std::string who =
          fmt::format("cameras.{}{}", k, n.name.empty() ? "" : " (" + n.name + ")");
      if (matched_[k] != nullptr)
        present.push_back(fmt::format("{} is {} {}", who, n.driver, matched_[k]->serial));
      else if (n.driver == "gige" && std::count(n.serial.begin(), n.serial.end(), '.') == 3)
        advise("cameras",
               who + ": no camera at " + n.serial +
                   " answers a broadcast; behind a router that is normal, else check cable, power "
                   "and address",
               {"ping -c 3 " + n.serial});
      else
        problem("cameras",
                fmt::format("{}: the {} camera{} is not there ({}); check cable, power and serial",
                            who, n.driver, n.serial.empty() ? "" : " " + n.serial,
                            format_list(find_driver(inventory_, n.driver))));
    }
    if (!present.empty()) ok("cameras", fmt::format("{}", fmt::join(present, ", ")));
  }

  /// Checks that this user may read and write the nodes; if not, the cause is another login,
  /// membership, or a rule that gives the node to the group.
  void check_nodes(const char* check, const std::string& group,
                   const std::vector<std::string>& nodes) {
    std::vector<std::string> closed;
    std::copy_if(nodes.begin(), nodes.end(), std::back_inserter(closed),
                 [&](const std::string& node) { return !machine_.may_use(node); });
    if (nodes.empty()) return;
    if (closed.empty()) return ok(check, fmt::format("{} may be opened", fmt::join(nodes, ", ")));
    const bool of_group = std::all_of(closed.begin(), closed.end(), [&](const std::string& node) {
      return machine_.group_of(node) == group;
    });
    const std::string what = fmt::format("{} may not be opened: ", fmt::join(closed, ", "));
    if (!of_group || machine_.in_group(group))
      return problem(
          check,
          what + fmt::format(
                     "they are not open to group {} (mode 0660); install the udev rules, or end a "
                     "serial console that holds the port (sudo systemctl mask --now "
                     "serial-getty@NAME)",
                     group),
          kInstallRules);
    problem(check,
            what + fmt::format("{} is not in group {}; add, then log out and in again",
                               machine_.user, group),
            {fmt::format("sudo usermod -aG {} {}", group, machine_.user)});
  }

  /// Nodes of everything that looks like a camera of a kind that is asked for; without a
  /// configuration of every kind.
  [[nodiscard]] std::vector<std::string> camera_nodes() const {
    const auto asked = [this](const char* driver) {
      return !given_ || std::any_of(needs_.cameras.begin(), needs_.cameras.end(),
                                    [&](const auto& c) { return c.driver == driver; });
    };
    std::vector<std::string> nodes;
    if (asked("v4l2"))
      for (const std::string& name : machine_.names("/sys/class/video4linux"))
        if (name.starts_with("video") && machine_.exists("/dev/" + name))
          nodes.push_back("/dev/" + name);
    if (asked("iidc-usb"))
      for (const UsbDevice& d : inventory_.usb)
        if (d.vendor == kPointGreyVendor) nodes.push_back(d.node());
    if (asked("iidc-1394"))
      for (const iidc::FirewireNode& n : inventory_.firewire) nodes.push_back(n.device);
    return nodes;
  }

  /// Returns true if a port is the one that a driver's key names; without a configuration, if it is
  /// on USB.
  [[nodiscard]] bool is_meant(const std::string& driver, const std::string& key,
                              const FoundPort& port) const {
    return given_ ? is_real_driver(driver) && names_port(machine_, key, port)
                  : port.info.usb_vendor != 0;
  }

  /// The configuration means one serial port that is there.
  void check_port(const char* group, const std::string& driver, const std::string& key) {
    if (!is_real_driver(driver) || (!key.empty() && machine_.exists(key))) return;
    const auto meant = std::count_if(inventory_.ports.begin(), inventory_.ports.end(),
                                     [&](const auto& f) { return names_port(machine_, key, f); });
    if (meant == 0 || (meant > 1 && group == std::string_view("ins")))
      problem(group, fmt::format("{}.port: {}: {} serial ports are meant by it; name one that "
                                 "`vergence devices` lists",
                                 group, key.empty() ? "empty" : key, meant));
  }

  [[nodiscard]] std::vector<std::string> serial_nodes() const {
    std::set<std::string> nodes;
    for (const auto& [driver, key] : {std::pair(needs_.ins.driver, needs_.ins.port),
                                      std::pair(needs_.trigger.driver, needs_.trigger.port)}) {
      for (const FoundPort& port : inventory_.ports)
        if (is_meant(driver, key, port)) nodes.insert(port.info.port);
      // A port that the list lacks, for instance of the board itself, is checked all the same.
      if (is_real_driver(driver) && key.starts_with("/") && machine_.exists(key))
        nodes.insert(machine_.target(key));
    }
    return {nodes.begin(), nodes.end()};
  }

  void check_latency() {
    constexpr int kAdvisedLatency = 16;  // ms: docs/ins.md
    for (const FoundPort& port : inventory_.ports) {
      const bool ins = port.kind == SerialKind::ins || port.kind == SerialKind::ftdi;
      if (!port.info.latency_timer_ms || !ins ||
          !is_meant(needs_.ins.driver, needs_.ins.port, port))
        continue;
      const int ms = *port.info.latency_timer_ms;
      const std::string message =
          fmt::format("{}: the converter's latency timer is {} ms", port.info.port, ms);
      if (ms == kAdvisedLatency)
        ok("latency_timer", message);
      else
        advise("latency_timer",
               fmt::format("{}; the INS's stamps are best with {} ms (docs/ins.md)", message,
                           kAdvisedLatency),
               {fmt::format("echo {} | sudo tee /sys/bus/usb-serial/devices/{}/latency_timer",
                            kAdvisedLatency,
                            std::filesystem::path(port.info.port).filename().string()),
                kInstallRules.front()});
    }
  }

  [[nodiscard]] std::vector<Reached> gige_cameras() const {
    std::vector<Reached> all;
    if (const DriverFindings* d = find_driver(inventory_, "gige"))
      for (const DeviceInfo& c : d->cameras) all.push_back({c.place, true, nullptr});
    // A camera that is configured by its address need not answer a broadcast.
    for (std::size_t k = 0; k < matched_.size(); ++k)
      if (matched_[k] == nullptr && needs_.cameras[k].driver == "gige")
        all.push_back({needs_.cameras[k].serial, false, nullptr});
    for (Reached& r : all)
      if (const auto address = ipv4(r.place)) r.through = way_to(machine_, *address);
    return all;
  }

  void check_network() {
    const std::vector<Reached> cameras = gige_cameras();
    if (cameras.empty()) return;
    check_receive_buffer();
    check_reach(cameras);
    std::set<std::string> links;
    for (const Reached& r : cameras)
      if (r.through != nullptr) links.insert(r.through->name);
    for (const std::string& name : links) {
      const auto mtu = machine_.number("/sys/class/net/" + name + "/mtu").value_or(kStandard);
      const std::string message = fmt::format("{} has an MTU of {}", name, mtu);
      if (mtu >= kJumbo)
        ok("mtu", message);
      else
        advise("mtu",
               fmt::format("{}: with {} (interface, and every switch on the way) a camera takes a "
                           "quarter of the processor's time",
                           message, kJumbo),
               {fmt::format("sudo ip link set dev {} mtu {}", name, kJumbo),
                fmt::format("sudo nmcli con mod {} 802-3-ethernet.mtu {}", name, kJumbo)});
    }
  }

  void check_receive_buffer() {
    const auto limit = machine_.number("/proc/sys/net/core/rmem_max");
    if (!limit) return;
    double image = 0;
    for (const CameraSettings& c : needs_.cameras)
      if (c.driver == "gige") image = std::max(image, bytes_per_pixel(c) * c.width * c.height);
    const auto requested = std::max(kMinBuffer, static_cast<std::int64_t>(kBufferedImages * image));
    const std::string message = fmt::format(
        "net.core.rmem_max is {} KiB; the receive buffer of a GigE camera should have {} KiB",
        *limit / 1024, requested / 1024);
    if (*limit >= requested || machine_.has_capability(CAP_NET_ADMIN))
      return ok("receive_buffer", message);
    const bool lost = static_cast<double>(*limit) < kMinImages * image;
    const std::string setting =
        fmt::format("net.core.rmem_max={}", std::max(kRecommendedBuffer, requested));
    // The last file by name counts, and the package's own is 10-vergence.conf.
    add(lost ? FindingState::problem : FindingState::advice, "receive_buffer",
        message + (lost ? ": images will be lost" : ""),
        {"sudo sysctl -w " + setting,
         "echo " + setting + " | sudo tee /etc/sysctl.d/90-vergence-rmem.conf"});
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
      add(r.found ? FindingState::problem : FindingState::advice, "camera_network",
          fmt::format("the camera at {} is in no network of this host: it {}", r.place,
                      r.found ? "answers broadcasts and nothing else"
                              : "is reached through a router, or not"),
          {fmt::format("sudo ip addr add {}/{} dev INTERFACE", dotted(own), link_local ? 16 : 24)});
    }
    if (!reached.empty()) ok("camera_network", fmt::format("{}", fmt::join(reached, ", ")));
  }

  void check_disk() {
    constexpr std::uint64_t kMin = std::uint64_t{200} << 20, kComfortable = std::uint64_t{2} << 30;
    const auto room = machine_.room_at(out_);
    if (!room) return;
    const std::string where = out_ == "." ? "the current folder" : out_.string();
    const std::string free =
        fmt::format("{:.1f} GB are free at {}", static_cast<double>(room->bytes) / 1e9, where);
    if (room->read_only)
      problem("disk",
              fmt::format("the file system of {} is read-only: no session can be written", where),
              {fmt::format("findmnt -T '{}'", out_.string())});
    else if (!room->may_write && given_)
      problem("disk", fmt::format("{} may not write at {}: name a folder of your own by --out",
                                  machine_.user, where));
    else if (room->bytes < kComfortable)
      add(room->bytes < kMin ? FindingState::problem : FindingState::advice, "disk",
          free + "; an hour's drive writes some 100 MB, recordings of images far more", {"df -h"});
    else
      ok("disk", free);
  }

  const Machine& machine_;
  const Inventory& inventory_;
  const Configuration& needs_;
  const bool given_;  // a configuration is checked, not only what is plugged in
  const std::filesystem::path out_;
  const std::vector<const DeviceInfo*> matched_;
  std::vector<Finding> findings_;
};

}  // namespace

std::vector<Finding> run_checks(const CheckContext& context) {
  std::vector<Finding> findings = Doctor(context).examine();
  std::stable_sort(findings.begin(), findings.end(),
                   [](const Finding& a, const Finding& b) { return a.state > b.state; });
  return findings;
}

}  // namespace vergence::app
