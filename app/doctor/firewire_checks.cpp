#include <algorithm>
#include <map>

#include <fmt/format.h>

#include "app/doctor/checks.hpp"
#include "drivers/iidc/budget_words.hpp"
#include "firmware_iface/iidc/bandwidth.hpp"
#include "firmware_iface/iidc/formats.hpp"

namespace vergence::app {
namespace {

iidc::BusSpeed speed_of(const CameraNeed& n) {
  const double s = n.option("speed", 400);
  if (s >= 800) return iidc::BusSpeed::s800;
  if (s >= 400) return iidc::BusSpeed::s400;
  return s >= 200 ? iidc::BusSpeed::s200 : iidc::BusSpeed::s100;
}

/// What a camera will ask of its bus, as far as it can be told without asking the camera: Mono8, a fixed mode where the standard has one
/// of that size, else a region of Format 7.
iidc::BusShare share_of(const CameraNeed& n) {
  iidc::BusShare share;
  share.speed = speed_of(n);
  share.image_bytes = static_cast<std::size_t>(std::max(0.0, n.bytes));
  const std::size_t most = iidc::largest_packet(share.speed);
  if (const double given = n.option("packet_bytes", 0); given > 0) {
    share.packet_bytes = static_cast<std::size_t>(std::min(given, static_cast<double>(most)));
    return share;
  }
  const auto code = iidc::rate_code_for(n.rate_hz);
  for (const iidc::FixedMode& m : iidc::fixed_modes())
    if (code && m.coding == iidc::ColorCoding::mono8 && m.width == n.width && m.height == n.height)
      share.packet_bytes = iidc::fixed_packet_bytes(m, *code);
  if (share.packet_bytes == 0 || share.packet_bytes > most)
    share.packet_bytes = iidc::packet_for_rate(share.image_bytes, n.rate_hz, 4, most);
  return share;
}

/// Cameras of a configuration by the bus they hang on; those that are not found share the first.
std::map<std::string, std::vector<iidc::BusShare>> shares_by_bus(const Patient& p) {
  std::map<std::string, std::vector<iidc::BusShare>> buses;
  const auto matched = match_cameras(p);
  const std::string first = p.inventory.firewire.empty() ? "" : p.inventory.firewire.front().bus;
  for (std::size_t k = 0; k < matched.size(); ++k) {
    const CameraNeed& n = p.needs.cameras[k];
    if (n.driver != "iidc-1394") continue;
    std::string bus = first;
    for (const iidc::FirewireNode& node : p.inventory.firewire)
      if (matched[k] != nullptr && matched[k]->info.place == node.device) bus = node.bus;
    buses[bus].push_back(share_of(n));
  }
  return buses;
}

}  // namespace

void check_firewire(const Patient& p, std::vector<Finding>* findings) {
  const bool wanted = !p.needs.of("iidc-1394").empty();
  if (wanted && !p.machine.exists("/sys/bus/firewire/devices")) {
    findings->push_back({"firewire",
                         FindingState::problem,
                         "this kernel has no FireWire stack; with an adapter card it comes with its driver",
                         {"sudo modprobe firewire-ohci", "echo firewire-ohci | sudo tee /etc/modules-load.d/vergence.conf"}});
  } else if (wanted && p.machine.names("/sys/bus/firewire/devices").empty()) {
    findings->push_back({"firewire",
                         FindingState::problem,
                         "there is no FireWire adapter; is the card seated, and its driver loaded?",
                         {"sudo modprobe firewire-ohci", "lspci | grep -i 1394"}});
  }
  for (const auto& [bus, shares] : shares_by_bus(p)) {
    std::string complaint;
    for (const iidc::BusShare& s : shares)
      if (s.packet_bytes == 0)
        complaint = fmt::format("an image of {} bytes does not pass at this rate even alone at {}", s.image_bytes, to_string(s.speed));
    if (complaint.empty()) complaint = iidc::budget_complaint(shares);
    if (!complaint.empty())
      findings->push_back({"firewire_bus", FindingState::problem, "IEEE 1394: " + complaint, {}});
    else
      findings->push_back({"firewire_bus",
                           FindingState::ok,
                           fmt::format("IEEE 1394: {} camera{} need {} of the bus's {} bandwidth units", shares.size(),
                                       shares.size() == 1 ? "" : "s", iidc::total_units(shares), iidc::kBandwidthUnits),
                           {}});
  }
}

}  // namespace vergence::app
