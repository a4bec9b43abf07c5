#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "firmware_iface/iidc/config_rom.hpp"

namespace vergence::iidc {

/// Camera on an IEEE 1394 bus, as listed by the kernel.
struct FirewireNode {
  /// Path of the node, as in /dev/fw1.
  std::string device;
  /// Identifies the bus: equal texts mean the same bus.
  std::string bus;
  ConfigRom rom{};
};

/// Cameras on all buses; opens no device. `root` differs from /sys only in tests.
[[nodiscard]] std::vector<FirewireNode> list_firewire_cameras(
    const std::filesystem::path& root = "/sys");

/// Returns true if the kernel has a FireWire stack.
[[nodiscard]] bool has_firewire(const std::filesystem::path& root = "/sys");

}  // namespace vergence::iidc
