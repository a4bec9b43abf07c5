#pragma once
#include <string>

#include "app/doctor/inventory.hpp"
#include "app/doctor/rig_devices.hpp"

namespace vergence::app {

/// A file for /etc/udev/rules.d about the devices that are plugged in: who may open them (groups
/// dialout and video), names under /dev/vergence that stay, ModemManager kept away, the latency
/// timer that docs/ins.md recommends, no autosuspend of cameras.
///
/// What a device says of itself is hostile: of its serial number only letters, digits and `._-` are
/// written, everything else matches any one character and is no part of a name. A pure function.
[[nodiscard]] std::string udev_rules(const Inventory& inventory);

/// The same about a rig's devices alone, a serial port being named by what the configuration has
/// on it; what is missing is said in comments.
[[nodiscard]] std::string udev_rules(const RigDevices& rig);

}  // namespace vergence::app
