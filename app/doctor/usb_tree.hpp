#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "app/doctor/machine.hpp"

namespace vergence::app {

/// A device on USB as the kernel lists it; nothing is opened.
struct UsbDevice {
  std::string port;  // `1-2.3`: bus and the ports on the way, the same as long as the cable stays
                     // where it is
  std::uint16_t vendor = 0, product = 0;
  std::string serial,
      title;  // title: manufacturer and product as the device says; either may be empty
  int bus = 0, number = 0;  // 0: not told
  double mbit = 0;          // speed of its connection; 0: not told
  std::string control;      // power/control: `on` stays awake, `auto` may be suspended; empty: the
                            // kernel has no such thing
  std::vector<std::string> video;  // video0, …: nodes of its interfaces

  [[nodiscard]] std::string node() const;  // /dev/bus/usb/001/004
};

/// Every device but root hubs, in the order of their ports.
[[nodiscard]] std::vector<UsbDevice> list_usb_devices(const Machine& machine);

}  // namespace vergence::app
