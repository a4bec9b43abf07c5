#pragma once
#include <string>
#include <vector>

#include "app/doctor/inventory.hpp"
#include "app/doctor/needs.hpp"

namespace vergence::app {

/// Ports that a configuration names by links, whatever their names, by the nodes they lead to.
[[nodiscard]] Needs with_nodes(Needs needs, const Machine& machine);

/// Whether a configuration's `port` means this port: by its name, a link to it, or its adapter's
/// serial number. Other links: with_nodes() first. An empty one means any port on USB.
[[nodiscard]] bool names_port(const std::string& key, const FoundPort& port);

/// What is plugged in, as far as a rig is concerned.
struct RigDevices {
  /// Serial ports have the kind of what the configuration has on them: `ins` or `board`.
  Inventory inventory;
  /// What the configuration names and nobody found, or more than one answers to: sentences.
  std::vector<std::string> missing;
};

/// A pure function. Network cameras are left out: they have no node that a rule could be about.
[[nodiscard]] RigDevices rig_devices(const Inventory& found, const Needs& needs);

}  // namespace vergence::app
