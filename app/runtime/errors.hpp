#pragma once
#include <stdexcept>
#include <string>
#include <utility>

#include <fmt/format.h>

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
  /// Formats the text.
  template <class First, class... Rest>
  InputError(fmt::format_string<First, Rest...> text, First&& first, Rest&&... rest)
      : runtime_error(fmt::format(text, std::forward<First>(first), std::forward<Rest>(rest)...)) {}
};

/// A configured device is missing, does not respond or is in use by another program. The text is
/// the whole message. Caught in main(), exit code 3: the command is valid and may be repeated once
/// the device is available.
class DeviceError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace vergence::app
