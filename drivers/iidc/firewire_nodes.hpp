#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "firmware_iface/iidc/config_rom.hpp"

namespace vergence::iidc {

/// One camera on an IEEE 1394 bus, as the kernel lists it.
struct FirewireNode {
  std::string device;  // /dev/fw1
  std::string bus;     // same text: same bus
  ConfigRom rom{};
};

/// The cameras on all buses; nothing is opened. `root`: /sys, elsewhere in tests.
[[nodiscard]] std::vector<FirewireNode> list_firewire_cameras(
    const std::filesystem::path& root = "/sys");

/// Returns true if the kernel has a FireWire stack.
[[nodiscard]] bool has_firewire(const std::filesystem::path& root = "/sys");

}  // namespace vergence::iidc
