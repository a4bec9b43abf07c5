#pragma once
#include <filesystem>

#include "app/config/configuration.hpp"
#include "app/runtime/errors.hpp"

namespace vergence::app {

struct SnapRequest {
  Configuration configuration;
  std::filesystem::path out;  // folder; must not exist or be empty
  int count = 1;              // sets
  double wait_s = 5;          // for a set
};

/// Opens the configured cameras, takes `count` synchronised sets, writes their pictures and
/// snap.json into the folder, a table to standard output and what strikes the eye to standard
/// error.
///
/// Cameras that wait for a pulse which does not come are asked by command, and where they have no
/// such command run freely; it says so.
/// → done, not_usable (pictures are there and no good), device_failed (a camera sent nothing),
///   interrupted, terminated
/// Errors  InputError: configuration, folder; DeviceError: devices that are not there.
[[nodiscard]] ExitCode capture_images(const SnapRequest& request);

}  // namespace vergence::app
