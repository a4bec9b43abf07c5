#pragma once
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "app/doctor/inventory.hpp"

namespace vergence::app {

/// Somebody who can ask a serial port whether its kind of device is there.
struct Asker {
  std::string group;   // of the configuration: `ins`, `trigger`
  std::string driver;  // `xsens`
  std::function<std::optional<DeviceInfo>(const std::string& port)> is_there;  // opens the port
};
/// One for each driver of INS and trigger boards.
[[nodiscard]] std::vector<Asker> all_askers();

/// Opens a serial port and asks who is there; fills in `device` and `configuration`. Ports that are
/// not on USB are left alone, XSens' own converters are asked for an INS only. Boards are asked for
/// first where one is likely, an INS where that is.
///
/// Opening makes boards with an automatic reset restart, and the question is a few bytes on the
/// line that another device may take for something else: only when the user says so. An INS that
/// answers has stopped measuring; a drive starts it again.
/// Time  Up to eight seconds. Errors: none; who does not answer is nobody.
void probe(FoundPort* port, const std::vector<Asker>& askers);

}  // namespace vergence::app
