#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include <fmt/format.h>

#include "app/doctor/checks.hpp"
#include "app/doctor/permissions.hpp"
#include "drivers/iidc/usb_bus.hpp"

namespace vergence::app {
namespace {

constexpr std::uint16_t kPointGrey = 0x1E10;
constexpr double kMebi = 1048576, kMega = 1e6;
constexpr double kUsb2 = 480, kUsb3 = 5000;              // Mbit/s
constexpr double kUsb2Carries = 33, kUsb3Carries = 350;  // MB/s of images, one controller

/// The USB device that a found camera is, by bus and number (`usb 001/004`) or by its video node.
/// Null: not on USB.
const UsbDevice* usb_of(const Inventory& inventory, const FoundCamera& c) {
  for (const UsbDevice& d : inventory.usb) {
    if (c.info.place == fmt::format("usb {:03}/{:03}", d.bus, d.number)) return &d;
    for (const std::string& node : d.video)
      if (c.info.place == "/dev/" + node) return &d;
  }
  return nullptr;
}

void check_memory(const CheckContext& p, std::vector<Finding>* findings) {
  const auto cameras = p.needs.of("iidc-usb");
  if (cameras.empty()) return;
  double megabytes = 0;
  for (const CameraNeed& n : cameras)
    megabytes += static_cast<double>(iidc::UsbBus::kTransfers) * n.bytes / kMebi;
  const auto limit = p.machine.number("/sys/module/usbcore/parameters/usbfs_memory_mb");
  if (!limit) return;
  Finding f{"usb_memory",
            FindingState::ok,
            fmt::format("{} IIDC camera{} need {:.1f} MB of USB memory, the kernel gives {}",
                        cameras.size(), cameras.size() == 1 ? "" : "s", megabytes,
                        *limit == 0 ? "as much as there is" : fmt::format("{} MB", *limit)),
            {}};
  if (*limit > 0 && megabytes > static_cast<double>(*limit)) {
    const int enough = std::max(64, static_cast<int>(std::ceil(2 * megabytes)));
    constexpr const char* kFile = "/sys/module/usbcore/parameters/usbfs_memory_mb";
    f.state = FindingState::problem;
    f.mend = {fmt::format("echo {} | sudo tee {}", enough, kFile),
              fmt::format("echo 'w {} - - - - {}' | sudo tee /etc/tmpfiles.d/vergence-usb.conf",
                          kFile, enough)};
  }
  findings->push_back(std::move(f));
}

void check_budget(const CheckContext& p, std::vector<Finding>* findings) {
  struct Load {
    double megabytes = 0;
    double mbit = kUsb2;
    int cameras = 0;
    bool reserves = false;  // USB video class: bandwidth is reserved for the worst case
  };
  std::map<int, Load> buses;
  const auto matched = match_cameras(p);
  for (std::size_t k = 0; k < matched.size(); ++k) {
    if (matched[k] == nullptr) continue;
    const UsbDevice* d = usb_of(p.inventory, *matched[k]);
    if (d == nullptr) continue;
    Load& load = buses[d->bus];
    load.megabytes += p.needs.cameras[k].bytes_per_second() / kMega;
    load.mbit = d->mbit > 0 ? d->mbit : kUsb2;
    load.reserves = load.reserves || p.needs.cameras[k].driver == "v4l2";
    ++load.cameras;
  }
  for (const auto& [bus, load] : buses) {
    const double carries =
        load.mbit > kUsb2 ? kUsb3Carries * load.mbit / kUsb3 : kUsb2Carries * load.mbit / kUsb2;
    Finding f{"usb_bus",
              FindingState::ok,
              fmt::format("USB bus {}: {} camera{}, {:.1f} MB/s of about {:.0f} that a controller "
                          "carries at {:.0f} Mbit/s",
                          bus, load.cameras, load.cameras == 1 ? "" : "s", load.megabytes, carries,
                          load.mbit),
              {}};
    if (load.megabytes > carries) {
      // What goes over the wire is the cameras' own business where a format was not named (a
      // compressed one is smaller).
      f.state = load.reserves ? FindingState::advice : FindingState::problem;
      f.sentence += ": give each camera a controller of its own, or lower rate or size";
    }
    findings->push_back(std::move(f));
  }
}

void check_sleep(const CheckContext& p, std::vector<Finding>* findings) {
  for (const UsbDevice& d : p.inventory.usb) {
    if (d.vendor != kPointGrey && d.video.empty()) continue;
    if (d.control == "auto")
      findings->push_back(
          {"usb_sleep",
           FindingState::advice,
           fmt::format("the camera on USB {} ({}) may be put to sleep when nobody streams, and "
                       "some do not wake up well",
                       d.port, d.title),
           {fmt::format("echo on | sudo tee /sys/bus/usb/devices/{}/power/control", d.port),
            commands_to_install_rules().front()}});
    constexpr std::uint16_t kFirstUsb3 = 0x3000;
    if (d.vendor == kPointGrey && d.product >= kFirstUsb3 && d.mbit > 0 && d.mbit <= kUsb2)
      findings->push_back({"usb_speed",
                           FindingState::advice,
                           fmt::format("the camera on USB {} ({}) is made for USB 3 and runs at "
                                       "{:.0f} Mbit/s: another port, cable or hub",
                                       d.port, d.title, d.mbit),
                           {}});
  }
}

}  // namespace

void check_usb(const CheckContext& p, std::vector<Finding>* findings) {
  check_memory(p, findings);
  check_budget(p, findings);
  check_sleep(p, findings);
}

}  // namespace vergence::app
