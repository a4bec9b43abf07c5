#pragma once
#include "app/config/configuration.hpp"

namespace vergence::app {

/// The configuration of a capture, for which of the devices only the cameras and what triggers them
/// are used: pictures need no position and the INS may be elsewhere, so it is left out, unless its
/// SyncOut makes the pulses.
[[nodiscard]] Configuration capture_configuration(const Configuration& configuration);

}  // namespace vergence::app
