#include <arpa/inet.h>
#include <linux/capability.h>

#include <algorithm>
#include <cstdint>
#include <optional>
#include <set>

#include <fmt/format.h>

#include "app/doctor/checks.hpp"

namespace vergence::app {
namespace {

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

std::vector<Reached> gige_cameras(const CheckContext& p) {
  std::vector<Reached> all;
  for (const DriverFindings& d : p.inventory.drivers)
    for (const DeviceInfo& c : d.cameras)
      if (d.name == "gige") all.push_back({c.place, true, nullptr});
  // A camera that is configured by its address need not answer a broadcast.
  const auto matched = match_cameras(p);
  for (std::size_t k = 0; k < matched.size(); ++k)
    if (matched[k] == nullptr && p.needs.cameras[k].driver == "gige")
      all.push_back({p.needs.cameras[k].serial, false, nullptr});
  for (Reached& r : all)
    if (const auto address = ipv4(r.place)) r.through = way_to(p.machine, *address);
  return all;
}

void check_receive_buffer(const CheckContext& p, std::vector<Finding>* findings) {
  const auto limit = p.machine.number("/proc/sys/net/core/rmem_max");
  if (!limit) return;
  double image = 0;
  for (const CameraNeed& n : p.needs.of("gige")) image = std::max(image, n.bytes);
  const auto requested = std::max(kMinBuffer, static_cast<std::int64_t>(kBufferedImages * image));
  const std::int64_t advised = std::max(kRecommendedBuffer, requested);
  Finding f{
      "receive_buffer",
      FindingState::ok,
      fmt::format(
          "net.core.rmem_max is {} KiB; the receive buffer of a GigE camera should have {} KiB",
          *limit / 1024, requested / 1024),
      {}};
  if (*limit < requested && !p.machine.has_capability(CAP_NET_ADMIN)) {
    const bool lost = static_cast<double>(*limit) < kMinImages * image;
    f.state = lost ? FindingState::problem : FindingState::advice;
    if (lost) f.message += ": images will be lost";
    // The last file by name counts, and the package's own is 10-vergence.conf.
    f.mend = {
        fmt::format("sudo sysctl -w net.core.rmem_max={}", advised),
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
         fmt::format("the camera at {} is in no network of this host: it {}", r.place,
                     r.found ? "answers broadcasts and nothing else"
                             : "is reached through a router, or not"),
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
        ": with {} (interface, and every switch on the way) a camera takes a quarter of the "
        "processor's time",
        kJumbo);
    f.mend = {fmt::format("sudo ip link set dev {} mtu {}", name, kJumbo),
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

}  // namespace vergence::app
