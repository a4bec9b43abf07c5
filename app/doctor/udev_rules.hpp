#pragma once
#include <string>

#include "app/doctor/checks.hpp"
#include "app/doctor/inventory.hpp"

namespace vergence::app {

/// A file for /etc/udev/rules.d about the devices that are plugged in: who may open them (groups
/// dialout and video), names under /dev/vergence that stay, ModemManager kept away, the latency
/// timer that docs/ins.md recommends, no autosuspend of cameras.
///
/// Texts of devices are untrusted: of a serial number only letters, digits and `._-` are written,
/// everything else matches any one character and is no part of a name. A pure function.
[[nodiscard]] std::string udev_rules(const Inventory& inventory);

/// The ports that the configuration means, as its INS and its trigger board; cameras unchanged.
/// Where it names no port, the ones on USB that carry such a device by their ids are meant.
[[nodiscard]] Inventory ports_of_rig(Inventory inventory, const Needs& needs,
                                     const Machine& machine);

}  // namespace vergence::app
