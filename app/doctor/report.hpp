#pragma once
#include <string>
#include <vector>

#include "app/doctor/checks.hpp"
#include "app/doctor/inventory.hpp"
#include "app/runtime/terminal_text.hpp"

/// Output of `vergence devices` and `vergence doctor`; the keys of the JSON are in docs/devices.md
/// and docs/doctor.md.
namespace vergence::app {

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
