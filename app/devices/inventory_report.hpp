#pragma once
#include "app/devices/doctor_checks.hpp"

/// Output of `vergence devices` and `vergence doctor`; docs/deployment.md has the keys of the JSON.
namespace vergence::app {

/// File for /etc/udev/rules.d for the plugged-in devices: access by the groups dialout and video,
/// stable names under /dev/vergence, no ModemManager, the latency timer recommended in docs/ins.md,
/// no autosuspend of cameras.
///
/// Texts of devices are untrusted: of a serial number only letters, digits and `._-` are written;
/// other characters match any one and are not part of a name.
[[nodiscard]] std::string udev_rules(const Inventory& inventory);

/// Keeps the ports that the configuration uses for INS and trigger board; cameras are unchanged. If
/// it names no port, those on USB with matching ids are used.
[[nodiscard]] Inventory ports_of_rig(Inventory inventory, const Configuration& drive,
                                     const Machine& machine);

/// Lines for a configuration, with what is known of each camera and port as a comment; then a
/// comment for each driver without a device.
[[nodiscard]] std::string devices_text(const Inventory& inventory);
/// `rules` is the file of --write-udev; empty if not requested.
[[nodiscard]] std::string devices_json(const Inventory& inventory, const std::string& rules);

/// `given` is set if there is a configuration; otherwise the last line asks for one.
[[nodiscard]] std::string doctor_text(const std::vector<Finding>& findings, bool given);
[[nodiscard]] std::string doctor_json(const std::vector<Finding>& findings);

}  // namespace vergence::app
