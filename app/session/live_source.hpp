#pragma once
#include <optional>
#include <string>
#include <vector>

#include "app/config/configuration.hpp"
#include "app/runtime/errors.hpp"
#include "app/session/session_runner.hpp"
#include "app/session/starting_calibration.hpp"

namespace vergence::app {

/// Request of a live run.
struct RunRequest {
  SessionOptions session{};
  Configuration configuration;
  CalibrationSource calibration{};   // --from-scratch, --calibration
  std::vector<std::string> faults;   // of the command line, beside the configuration's
  std::optional<double> duration_s;  // all of the drive when not set
  bool fast = false;                 // virtual time: nothing is dropped for time
};

/// Drives: the cameras, INS and board of the configuration into a session folder (run_session()).
///
/// Errors   InputError, DeviceError before the session folder is made, for all that can be known by
///          then. Afterwards messages on stderr.
/// → as run_session(); device_failed: a camera was gone at the end
[[nodiscard]] ExitCode run_drive(const RunRequest& request);

}  // namespace vergence::app
