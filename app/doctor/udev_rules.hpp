#pragma once
#include <string>

#include "app/doctor/inventory.hpp"

namespace vergence::app {

/// A file for /etc/udev/rules.d about the devices that are plugged in: who may open them (groups
/// dialout and video), names under /dev/vergence that stay, ModemManager kept away, the latency
/// timer that docs/ins.md recommends, no autosuspend of cameras.
///
/// What a device says of itself is hostile: of its serial number only letters, digits and `._-` are
/// written, everything else matches any one character and is no part of a name. A pure function.
[[nodiscard]] std::string udev_rules(const Inventory& inventory);

}  // namespace vergence::app
