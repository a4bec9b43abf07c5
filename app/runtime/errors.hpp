#pragma once
#include <stdexcept>
#include <string>

namespace vergence::app {

/// Exit codes of the program.
enum class ExitCode : int {
  done = 0,
  not_usable = 1,
  bad_input = 2,
  device_failed = 3,  // not there at the start, or gone and not back
  not_written = 4,    // done, but a file of the result is missing or not whole
  interrupted = 130,
  terminated = 143
};

/// Arguments, configuration or input that cannot be used. The text is the whole message for the
/// user: which file (with its line) or key, what is wrong, what to do. Caught in main(), exit code
/// 2.
class InputError : public std::runtime_error {
 public:
  explicit InputError(const std::string& message) : std::runtime_error(message) {}
};

/// A device that the configuration names is not there, does not answer, or is in use by another
/// program. The text is the whole message for the user. Caught in main(), exit code 3: what is
/// asked for is in order and may be asked again when the device has its power.
class DeviceError : public std::runtime_error {
 public:
  explicit DeviceError(const std::string& message) : std::runtime_error(message) {}
};

}  // namespace vergence::app
