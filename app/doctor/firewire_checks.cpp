#include <algorithm>
#include <map>

#include <fmt/format.h>

#include "app/doctor/checks.hpp"
#include "drivers/iidc/budget_words.hpp"
#include "firmware_iface/iidc/bandwidth.hpp"
#include "firmware_iface/iidc/formats.hpp"

namespace vergence::app {
namespace {

iidc::Options options_of(const CameraNeed& n) {
  const auto* given = std::get_if<iidc::Options>(&n.options);
  return given != nullptr ? *given : iidc::Options{};
}

struct Share {
  iidc::BusShare bus{};
  bool format7 = false;
};

/// What a camera will ask of its bus, as far as it can be told without asking the camera: Mono8, a
/// fixed mode where the standard has one of that size and all cameras of the rig can send its
/// packets, else a region of Format 7.
Share share_of(const CameraNeed& n, std::size_t sharing) {
  Share share;
  iidc::BusShare& bus = share.bus;
  const iidc::Options options = options_of(n);
  bus.speed = options.speed.value_or(iidc::BusSpeed::s400);
  bus.image_bytes = static_cast<std::size_t>(std::max(0.0, n.bytes));
  const std::size_t most = iidc::largest_packet(bus.speed);
  if (options.packet_bytes) {
    bus.packet_bytes = std::min(*options.packet_bytes, most);
    return share;
  }
  const auto code = iidc::rate_code_for(n.rate_hz);
  for (const iidc::FixedMode& m : iidc::fixed_modes())
    if (code && m.coding == iidc::ColorCoding::mono8 && m.width == n.width && m.height == n.height)
      bus.packet_bytes = iidc::fixed_packet_bytes(m, *code);
  if (bus.packet_bytes > most) bus.packet_bytes = 0;
  const auto cameras = static_cast<unsigned>(std::clamp<std::size_t>(sharing, 1, kMaxCameras));
  if (bus.packet_bytes != 0 &&
      iidc::bandwidth_units(bus.packet_bytes, bus.speed) * cameras <= iidc::kBandwidthUnits)
    return share;
  const std::size_t fair = iidc::packet_for_units(iidc::kBandwidthUnits / cameras, bus.speed);
  const std::size_t fits = iidc::packet_for_rate(bus.image_bytes, n.rate_hz, 4, fair);
  share.format7 = fits != 0;
  if (fits != 0) bus.packet_bytes = fits;
  if (bus.packet_bytes == 0)
    bus.packet_bytes = iidc::packet_for_rate(bus.image_bytes, n.rate_hz, 4, most);
  return share;
}

/// The cameras of a configuration on one bus.
struct Demand {
  std::vector<const CameraNeed*> cameras;
  std::vector<iidc::BusShare> shares;
  bool format7 = false;
};

/// By the bus that the cameras hang on; those that are not found share the first.
std::map<std::string, Demand> demands(const CheckContext& p) {
  std::map<std::string, Demand> buses;
  const auto matched = match_cameras(p);
  const std::string first = p.inventory.firewire.empty() ? "" : p.inventory.firewire.front().bus;
  for (std::size_t k = 0; k < matched.size(); ++k) {
    const CameraNeed& n = p.needs.cameras[k];
    if (n.driver != "iidc-1394") continue;
    std::string bus = first;
    for (const iidc::FirewireNode& node : p.inventory.firewire)
      if (matched[k] != nullptr && matched[k]->info.place == node.device) bus = node.bus;
    buses[bus].cameras.push_back(&n);
  }
  for (auto& [bus, demand] : buses)
    for (const CameraNeed* n : demand.cameras) {
      const Share share = share_of(*n, demand.cameras.size());
      demand.shares.push_back(share.bus);
      demand.format7 = demand.format7 || share.format7;
    }
  return buses;
}

Finding judged(const Demand& demand) {
  for (const iidc::BusShare& s : demand.shares)
    if (s.packet_bytes == 0)
      return {
          "firewire_bus",
          FindingState::problem,
          fmt::format("IEEE 1394: an image of {} bytes does not pass at this rate even alone at {}",
                      s.image_bytes, to_string(s.speed)),
          {}};
  if (const std::string error = iidc::budget_error(demand.shares); !error.empty())
    return {"firewire_bus", FindingState::problem, "IEEE 1394: " + error, {}};
  return {
      "firewire_bus",
      FindingState::ok,
      fmt::format("IEEE 1394: {} camera{} need {} of the bus's {} bandwidth units{}",
                  demand.shares.size(), demand.shares.size() == 1 ? "" : "s",
                  iidc::total_units(demand.shares), iidc::kBandwidthUnits,
                  demand.format7 ? ", with regions of Format 7, which the cameras must have" : ""),
      {}};
}

}  // namespace

void check_firewire(const CheckContext& p, std::vector<Finding>* findings) {
  const bool requested = !p.needs.of("iidc-1394").empty();
  if (requested && !p.machine.exists("/sys/bus/firewire/devices")) {
    findings->push_back(
        {"firewire",
         FindingState::problem,
         "this kernel has no FireWire stack; with an adapter card it comes with its driver",
         {"sudo modprobe firewire-ohci",
          "echo firewire-ohci | sudo tee /etc/modules-load.d/vergence.conf"}});
  } else if (requested && p.machine.names("/sys/bus/firewire/devices").empty()) {
    findings->push_back({"firewire",
                         FindingState::problem,
                         "there is no FireWire adapter; is the card seated, and its driver loaded?",
                         {"sudo modprobe firewire-ohci", "lspci | grep -i 1394"}});
  }
  for (const auto& [bus, demand] : demands(p)) findings->push_back(judged(demand));
}

}  // namespace vergence::app
