#pragma once
#include "app/config/configuration.hpp"
#include "app/runtime/errors.hpp"

namespace vergence::app {

struct SnapRequest {
  Configuration configuration;
  /// Directory that must not exist or be empty.
  std::filesystem::path out;
  /// Number of sets.
  int count = 1;
  /// Time limit per set.
  double wait_s = 5;
};

/// Captures `count` synchronised sets of the configured cameras. Writes images and snap.json to the
/// directory, a table to standard output and visible image defects to standard error.
///
/// Cameras whose trigger pulse is missing are triggered by command or, if unsupported, run freely,
/// which is reported. Returns done, not_usable (the images are unusable), device_failed (a camera
/// sent nothing), interrupted or terminated. Throws InputError (configuration, directory) and
/// DeviceError (missing devices).
[[nodiscard]] ExitCode capture_images(const SnapRequest& request);

}  // namespace vergence::app
