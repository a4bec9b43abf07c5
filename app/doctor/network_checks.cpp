#include <arpa/inet.h>
#include <linux/capability.h>

#include <algorithm>
#include <cstdint>
#include <map>
#include <optional>

#include <fmt/format.h>

#include "app/doctor/checks.hpp"
#include "drivers/gige/link_budget.hpp"

namespace vergence::app {
namespace {

// As the driver asks for its sockets: eight images, 4 MiB at least; with less than two, images are
// lost.
constexpr double kBufferedImages = 8, kLeastImages = 2;
constexpr std::int64_t kLeastBuffer = std::int64_t{4} << 20;
constexpr std::int64_t kRecommendedBuffer = 10'485'760;
constexpr int kJumbo = 9000, kStandard = 1500;  // bytes
constexpr double kGigabit = 1e9;                // bit/s, where the system does not say
constexpr double kMega = 1e6;
constexpr std::size_t kMostOnLink = 16;
constexpr double kMostMegabits = 1e6;

std::optional<std::uint32_t> ipv4(const std::string& text) {
  in_addr a{};
  if (::inet_pton(AF_INET, text.c_str(), &a) != 1) return std::nullopt;
  return ntohl(a.s_addr);
}

std::string dotted(std::uint32_t a) {
  return fmt::format("{}.{}.{}.{}", a >> 24U, a >> 16U & 255U, a >> 8U & 255U, a & 255U);
}

int prefix(std::uint32_t mask) {
  int n = 0;
  for (; mask != 0; mask <<= 1U) n += (mask >> 31U) != 0 ? 1 : 0;
  return n;
}

std::string shown(const InterfaceAddress& a) {
  return fmt::format("{} {}/{}", a.name, dotted(a.address), prefix(a.mask));
}

/// The interface through which an address is reached: the longest mask that fits.
const InterfaceAddress* way_to(const Machine& m, std::uint32_t address) {
  const InterfaceAddress* best = nullptr;
  for (const InterfaceAddress& a : m.addresses)
    if (((a.address ^ address) & a.mask) == 0 && (best == nullptr || a.mask > best->mask))
      best = &a;
  return best;
}

bool overlap(const InterfaceAddress& a, const InterfaceAddress& b) {
  return a.name != b.name && ((a.address ^ b.address) & a.mask & b.mask) == 0;
}

/// A camera and the way to it.
struct Reached {
  const FoundCamera* camera = nullptr;
  const CameraNeed* need = nullptr;  // null: no configuration asks for it
  const InterfaceAddress* through = nullptr;
};

std::vector<Reached> gige_cameras(const CheckContext& p) {
  std::vector<Reached> all;
  const auto matched = match_cameras(p);
  for (const DriverFindings& d : p.inventory.drivers) {
    if (d.name != "gige") continue;
    for (const FoundCamera& c : d.cameras) {
      Reached r{&c, nullptr, nullptr};
      const auto at = std::find(matched.begin(), matched.end(), &c);
      if (at != matched.end())
        r.need = &p.needs.cameras[static_cast<std::size_t>(at - matched.begin())];
      if (const auto a = ipv4(c.info.place)) r.through = way_to(p.machine, *a);
      all.push_back(r);
    }
  }
  // Those at an address that no broadcast found are reached all the same.
  for (std::size_t k = 0; k < matched.size(); ++k) {
    const CameraNeed& n = p.needs.cameras[k];
    if (matched[k] != nullptr || n.driver != "gige") continue;
    const auto a = ipv4(n.serial);
    all.push_back({nullptr, &n, a ? way_to(p.machine, *a) : nullptr});
  }
  return all;
}

void check_receive_buffer(const CheckContext& p, std::vector<Finding>* findings) {
  const auto limit = p.machine.number("/proc/sys/net/core/rmem_max");
  if (!limit) return;
  double image = 0;
  for (const CameraNeed& n : p.needs.of("gige")) image = std::max(image, n.bytes);
  const auto requested = std::max(kLeastBuffer, static_cast<std::int64_t>(kBufferedImages * image));
  const std::int64_t advised = std::max(kRecommendedBuffer, requested);
  const std::string holds = image > 0 ? fmt::format(", {:.1f} images of this configuration",
                                                    static_cast<double>(*limit) / image)
                                      : "";
  Finding f{
      "receive_buffer",
      FindingState::ok,
      fmt::format(
          "net.core.rmem_max is {} KiB{}; the receive buffer of a GigE camera should have {} KiB",
          *limit / 1024, holds, requested / 1024),
      {}};
  if (*limit < requested) {
    const bool lost = image > 0 && static_cast<double>(*limit) < kLeastImages * image;
    f.state = lost ? FindingState::problem : FindingState::advice;
    if (lost) f.sentence += ": images will be lost";
    if (p.machine.has_capability(CAP_NET_ADMIN)) {
      f.state = FindingState::ok;
      f.sentence += "; this user may go beyond it";
    } else {
      // Sorted behind the package's own file: the last one counts.
      f.mend = {
          fmt::format("sudo sysctl -w net.core.rmem_max={}", advised),
          fmt::format("echo net.core.rmem_max={} | sudo tee /etc/sysctl.d/90-vergence-rmem.conf",
                      advised)};
    }
  }
  findings->push_back(std::move(f));
}

std::vector<std::string> commands_for_network(const Machine& m, std::uint32_t camera) {
  // Wired interfaces with a cable in: one of them it is.
  std::vector<std::string> wired;
  for (const std::string& name : m.names("/sys/class/net"))
    if (m.exists("/sys/class/net/" + name + "/device") &&
        !m.exists("/sys/class/net/" + name + "/wireless") &&
        m.number("/sys/class/net/" + name + "/carrier").value_or(0) == 1)
      wired.push_back(name);
  const bool link_local = camera >> 16U == 0xA9FEU;
  const std::uint32_t own = (camera & ~255U) | ((camera & 255U) == 1 ? 2U : 1U);
  return {fmt::format("sudo ip addr add {}/{} dev {}", dotted(own), link_local ? 16 : 24,
                      wired.size() == 1 ? wired.front() : "INTERFACE")};
}

void check_reach(const CheckContext& p, const std::vector<Reached>& cameras,
                 std::vector<Finding>* findings) {
  std::string fine;
  for (const Reached& r : cameras) {
    const std::string place = r.camera != nullptr ? r.camera->info.place : r.need->serial;
    const auto address = ipv4(place);
    if (!address) continue;
    if (r.through != nullptr) {
      fine += fmt::format("{}{} through {}", fine.empty() ? "" : ", ", place, shown(*r.through));
      continue;
    }
    std::vector<std::string> own;
    for (const InterfaceAddress& a : p.machine.addresses)
      if (a.address >> 24U != 127) own.push_back(shown(a));
    findings->push_back(
        {"camera_network", r.camera != nullptr ? FindingState::problem : FindingState::advice,
         fmt::format("the camera at {} is in no network of this host ({}): it {}", place,
                     own.empty() ? "no address" : fmt::format("{}", fmt::join(own, ", ")),
                     r.camera != nullptr ? "answers broadcasts and nothing else"
                                         : "is reached through a router, or not"),
         commands_for_network(p.machine, *address)});
  }
  if (!fine.empty()) findings->push_back({"camera_network", FindingState::ok, fine, {}});
  if (!cameras.empty() && std::all_of(cameras.begin(), cameras.end(),
                                      [](const Reached& r) { return r.camera == nullptr; }))
    for (const std::string& name : p.machine.names("/sys/class/net")) {
      const std::string folder = "/sys/class/net/" + name;
      const bool wired =
          p.machine.exists(folder + "/device") && !p.machine.exists(folder + "/wireless");
      const bool named = std::any_of(p.machine.addresses.begin(), p.machine.addresses.end(),
                                     [&](const auto& a) { return a.name == name; });
      if (wired && !named && p.machine.number(folder + "/carrier").value_or(0) == 1)
        findings->push_back({"camera_network",
                             FindingState::advice,
                             fmt::format("{} has a cable and no address; cameras without a fixed "
                                         "one take one of 169.254.0.0/16, which "
                                         "this host must have, too",
                                         name),
                             {fmt::format("sudo ip addr add 169.254.1.1/16 dev {}", name),
                              fmt::format("sudo nmcli con mod {} ipv4.method link-local", name)}});
    }
}

/// The cameras on one interface; its facts.
struct Link {
  std::string name;
  int mtu = kStandard;
  double speed = 0;  // bit/s; 0: the system does not say
  std::vector<const CameraNeed*> needs;
  std::size_t cameras = 0;
};

std::vector<Link> links_of(const Machine& m, const std::vector<Reached>& cameras) {
  std::map<std::string, Link> links;
  for (const Reached& r : cameras) {
    Link& link = links[r.through == nullptr ? "" : r.through->name];
    ++link.cameras;
    if (r.need != nullptr) link.needs.push_back(r.need);
    if (r.through == nullptr) continue;
    link.name = r.through->name;
    link.mtu = static_cast<int>(std::clamp<std::int64_t>(
        m.number("/sys/class/net/" + link.name + "/mtu").value_or(kStandard), 68, 65536));
    const std::int64_t megabits = m.number("/sys/class/net/" + link.name + "/speed").value_or(0);
    link.speed = megabits > 0 ? static_cast<double>(megabits) * kMega : 0;
  }
  std::vector<Link> all;
  all.reserve(links.size());
  for (auto& [name, link] : links) all.push_back(std::move(link));
  return all;
}

void check_mtu(const Link& link, std::vector<Finding>* findings) {
  if (link.name.empty()) return;
  if (link.mtu >= kJumbo) {
    findings->push_back(
        {"mtu",
         FindingState::ok,
         fmt::format("{} carries packets of {} bytes", link.name, std::min(link.mtu, kJumbo)),
         {}});
    return;
  }
  findings->push_back(
      {"mtu",
       FindingState::advice,
       fmt::format("{} has an MTU of {}: with {} (interface, and every switch on the way) a camera "
                   "takes a quarter of the "
                   "processor's time",
                   link.name, link.mtu, kJumbo),
       {fmt::format("sudo ip link set dev {} mtu {}", link.name, kJumbo),
        fmt::format("sudo nmcli con mod {} 802-3-ethernet.mtu {}", link.name, kJumbo)}});
}

void check_load(const Link& link, std::vector<Finding>* findings) {
  const double slowest = link.speed > 0 ? link.speed : kGigabit;
  if (link.speed > 0 && link.speed < kGigabit)
    findings->push_back(
        {"link",
         FindingState::advice,
         fmt::format(
             "{} runs at {:.0f} Mbit/s; GigE cameras need a gigabit: check cable and switch",
             link.name, link.speed / kMega),
         {}});
  if (link.needs.empty()) return;
  double used = 0, megabytes = 0, highest = 0, megabits = 0;
  for (const CameraNeed* n : link.needs) {
    gige::LinkDemand d;
    d.image_bytes = static_cast<std::int64_t>(n->bytes);
    d.rate_hz = n->rate_hz;
    const auto* given = std::get_if<gige::Options>(&n->options);
    const gige::Options options = given != nullptr ? *given : gige::Options{};
    d.cameras = options.link_cameras > 0
                    ? options.link_cameras
                    : static_cast<int>(std::clamp<std::size_t>(link.needs.size(), 1, kMostOnLink));
    d.mtu = link.mtu;
    d.packet_size = options.packet_size;
    megabits =
        options.link_mbps > 0 ? options.link_mbps : std::clamp(slowest / kMega, 1.0, kMostMegabits);
    d.speed = static_cast<std::int64_t>(megabits * kMega);
    const gige::LinkBudget budget = gige::link_budget(d);
    if (budget.used >= used) used = budget.used, highest = budget.highest_hz;
    megabytes += n->bytes_per_second() / kMega;
  }
  const std::string where = link.name.empty() ? "on a link that is not known" : link.name;
  Finding f{
      "link",
      FindingState::ok,
      fmt::format("{}: {} camera{}, {:.0f} MB/s of images, {:.0f} % of what {:.0f} Mbit/s carry",
                  where, link.needs.size(), link.needs.size() == 1 ? "" : "s", megabytes,
                  100 * used, megabits),
      {}};
  if (used > 1) {
    f.state = FindingState::problem;
    f.sentence += fmt::format(
        "; they fit up to {:.1f} Hz (trigger.rate), with smaller images, or on links of their own",
        highest);
  }
  findings->push_back(std::move(f));
}

void check_rp_filter(const CheckContext& p, const std::vector<Reached>& cameras,
                     std::vector<Finding>* findings) {
  std::vector<std::string> reported;
  const auto filter = [&](const std::string& name) {
    return p.machine.number("/proc/sys/net/ipv4/conf/" + name + "/rp_filter").value_or(0);
  };
  for (const Reached& r : cameras) {
    if (r.through == nullptr ||
        std::find(reported.begin(), reported.end(), r.through->name) != reported.end())
      continue;
    const auto other = std::find_if(p.machine.addresses.begin(), p.machine.addresses.end(),
                                    [&](const auto& a) { return overlap(*r.through, a); });
    if (other == p.machine.addresses.end()) continue;
    reported.push_back(r.through->name);
    const bool strict = std::max(filter("all"), filter(r.through->name)) == 1;
    findings->push_back(
        {"rp_filter", strict ? FindingState::problem : FindingState::advice,
         fmt::format("{} and {} are in one network: the kernel sends through one of them{}; give "
                     "each a network of its own{}",
                     shown(*r.through), shown(*other),
                     strict ? " and drops what comes in by the other (rp_filter 1)" : "",
                     strict ? ", or loosen the filter" : ""),
         strict ? std::vector{fmt::format("sudo sysctl -w net.ipv4.conf.{}.rp_filter=2",
                                          r.through->name),
                              fmt::format("echo net.ipv4.conf.{}.rp_filter=2 | sudo tee "
                                          "/etc/sysctl.d/90-vergence-rp-filter.conf",
                                          r.through->name)}
                : std::vector<std::string>{}});
  }
}

void check_packet_socket(const CheckContext& p, std::vector<Finding>* findings) {
  for (const CameraNeed& n : p.needs.of("gige")) {
    const auto* options = std::get_if<gige::Options>(&n.options);
    if (options == nullptr || !options->packet_socket) continue;
    const bool may = p.machine.has_capability(CAP_NET_RAW);
    findings->push_back(
        {"packet_socket", may ? FindingState::ok : FindingState::problem,
         may ? "packet_socket is on, and this user may have one (CAP_NET_RAW)"
             : n.key + ".options.packet_socket is on, which needs CAP_NET_RAW: give it to the "
                       "program, or leave the option out",
         may ? std::vector<std::string>{}
             : std::vector<std::string>{
                   "sudo setcap cap_net_raw+ep \"$(readlink -f \"$(command -v vergence)\")\""}});
    return;
  }
}

}  // namespace

void check_network(const CheckContext& p, std::vector<Finding>* findings) {
  const std::vector<Reached> cameras = gige_cameras(p);
  if (cameras.empty()) return;
  check_receive_buffer(p, findings);
  check_reach(p, cameras, findings);
  for (const Link& link : links_of(p.machine, cameras)) {
    check_mtu(link, findings);
    check_load(link, findings);
  }
  check_rp_filter(p, cameras, findings);
  check_packet_socket(p, findings);
}

}  // namespace vergence::app
