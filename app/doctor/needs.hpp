#pragma once
#include <string>
#include <vector>

#include "app/config/configuration.hpp"

namespace vergence::app {

/// One camera, as far as the machine below it is concerned.
struct CameraNeed {
  std::string key, name;  // `cameras.0`, `left`
  std::string driver, serial;
  double bytes = 0;    // of an image on its way
  double rate_hz = 0;  // that the camera runs at, which may be more than the rig's
  CameraOptions options;
};

/// What a drive with a configuration asks of the machine.
struct Needs {
  bool given = false;  // false: no configuration; then only what is plugged in is checked
  std::vector<CameraNeed> cameras;
  std::string ins_driver, ins_port;
  std::string trigger_driver, trigger_port;
  int realtime_priority = 0;  // realtime.priority; 0: no thread asks for one
  bool lock_memory = false;   // realtime.lock_memory

  [[nodiscard]] std::vector<CameraNeed> of(const std::string& driver) const;
};

/// InputError: a hole in the list of cameras.
[[nodiscard]] Needs needs_of(const Configuration& configuration);

/// Returns true if a driver talks to a device: it is neither empty nor `none` nor `mock`.
[[nodiscard]] bool is_real_driver(const std::string& driver);

}  // namespace vergence::app
