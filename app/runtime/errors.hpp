#pragma once
#include <stdexcept>
#include <string>

namespace vergence::app {

/// Exit codes of the program.
enum class ExitCode : int {
  done = 0,
  not_usable = 1,
  bad_input = 2,
  /// A device is missing at the start, or was lost and did not reconnect.
  device_failed = 3,
  /// The run completed, but a result file is missing or incomplete.
  not_written = 4,
  interrupted = 130,
  terminated = 143
};

/// Arguments, configuration or input that cannot be used. The text is the whole message: the file
/// (with line) or key, the problem and the fix. Caught in main(), exit code 2.
class InputError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A configured device is missing, does not respond or is in use by another program. The text is
/// the whole message. Caught in main(), exit code 3: the command is valid and may be repeated once
/// the device is available.
class DeviceError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace vergence::app
