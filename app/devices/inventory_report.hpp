#pragma once
#include <string>
#include <vector>

#include "app/devices/doctor_checks.hpp"
#include "app/devices/inventory.hpp"
#include "app/runtime/terminal_text.hpp"

/// Output of `vergence devices` and `vergence doctor`; the keys of the JSON are in
/// docs/deployment.md and docs/deployment.md.
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
[[nodiscard]] Inventory ports_of_rig(Inventory inventory, const Configuration& drive,
                                     const Machine& machine);

/// Cameras, serial ports, what to paste into a configuration, and a line for each driver that found
/// nothing.
[[nodiscard]] std::string devices_text(const Inventory& inventory, const Terminal& terminal);
/// `rules`: of --write-udev; empty where they were not asked for.
[[nodiscard]] std::string devices_json(const Inventory& inventory, const std::string& rules);

/// `given`: there is a configuration; without one the last line asks for it.
[[nodiscard]] std::string doctor_text(const std::vector<Finding>& findings, bool given,
                                      const Terminal& terminal);
[[nodiscard]] std::string doctor_json(const std::vector<Finding>& findings);

}  // namespace vergence::app
