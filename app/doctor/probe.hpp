#pragma once
#include "app/doctor/inventory.hpp"

namespace vergence::app {

/// Opens a serial port and asks who is there; fills in `device` and `configuration`. Ports that are not on USB are left alone.
///
/// Opening makes boards with an automatic reset start anew, and the question is a few bytes on the line that another device may take for
/// something else: only when the user says so. An XSens is left measuring or waiting, as it was asked.
/// Time  Up to six seconds. Errors: none; who does not answer is nobody.
void probe(FoundPort* port);

}  // namespace vergence::app
