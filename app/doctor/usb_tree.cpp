#include "app/doctor/usb_tree.hpp"

#include <fmt/format.h>

#include <cstdlib>

namespace vergence::app {
namespace {

constexpr const char* kDevices = "/sys/bus/usb/devices/";

int small_number(const Machine& m, const std::string& path) {
  const auto n = m.number(path);
  return n && *n > 0 && *n < 1000 ? static_cast<int>(*n) : 0;
}

/// `480`, or `1.5` of a slow device.
double speed_of(const Machine& m, const std::string& path) {
  const auto text = m.line(path);
  const double mbit = text ? std::strtod(text->c_str(), nullptr) : 0;
  return mbit > 0 && mbit < 1e6 ? mbit : 0;
}

std::vector<std::string> video_nodes(const Machine& m, const std::string& folder,
                                     const std::string& port) {
  std::vector<std::string> nodes;
  for (const std::string& entry : m.names(folder))
    if (entry.starts_with(port + ":"))
      for (const std::string& node : m.names(fmt::format("{}/{}/video4linux", folder, entry)))
        nodes.push_back(node);
  return nodes;
}

}  // namespace

std::string UsbDevice::node() const { return fmt::format("/dev/bus/usb/{:03}/{:03}", bus, number); }

std::vector<UsbDevice> list_usb_devices(const Machine& m) {
  std::vector<UsbDevice> all;
  for (const std::string& name : m.names(kDevices)) {
    // usb1 is a root hub, 1-2:1.0 an interface of 1-2.
    if (name.find(':') != std::string::npos || name.find('-') == std::string::npos) continue;
    const std::string folder = kDevices + name;
    const auto vendor = m.hex16(folder + "/idVendor"), product = m.hex16(folder + "/idProduct");
    if (!vendor || !product) continue;
    UsbDevice d;
    d.port = name;
    d.vendor = *vendor;
    d.product = *product;
    d.serial = m.line(folder + "/serial").value_or("");
    const std::string maker = m.line(folder + "/manufacturer").value_or(""),
                      what = m.line(folder + "/product").value_or("");
    d.title = maker.empty() || what.starts_with(maker) ? what
              : what.empty()                           ? maker
                                                       : fmt::format("{} {}", maker, what);
    d.bus = small_number(m, folder + "/busnum");
    d.number = small_number(m, folder + "/devnum");
    d.mbit = speed_of(m, folder + "/speed");
    d.control = m.line(folder + "/power/control").value_or("");
    d.video = video_nodes(m, folder, name);
    all.push_back(std::move(d));
  }
  return all;
}

}  // namespace vergence::app
