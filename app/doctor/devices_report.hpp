#pragma once
#include <string>

#include "app/doctor/inventory.hpp"
#include "app/runtime/terminal_text.hpp"

namespace vergence::app {

/// The list for people: cameras, serial ports, what to paste into a configuration, and a sentence
/// for each driver that found nothing.
[[nodiscard]] std::string devices_text(const Inventory& inventory, const Terminal& terminal);
/// The same for programs; keys as in docs/devices.md. `rules`: of --write-udev, empty: not asked
/// for.
[[nodiscard]] std::string devices_json(const Inventory& inventory, const std::string& rules);

}  // namespace vergence::app
