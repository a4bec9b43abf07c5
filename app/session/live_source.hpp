#pragma once
#include "app/session/session_runner.hpp"

namespace vergence::app {

/// Request of a live run.
struct RunRequest {
  SessionOptions session{};
  Configuration configuration;
  /// Value of --from-scratch and --calibration.
  CalibrationSource calibration{};
  /// Faults of the command line, in addition to the configuration's.
  std::vector<std::string> faults;
  /// Empty runs to the end.
  std::optional<double> duration_s;
  /// Virtual time, in which nothing is dropped.
  bool fast = false;
};

/// Drives: the cameras, INS and board of the configuration into a session folder (run_session()).
///
/// Errors   InputError, DeviceError before the session folder is made, for all that can be known by
///          then. Afterwards messages on stderr.
/// → as run_session(); device_failed: a camera was disconnected at the end
[[nodiscard]] ExitCode run_drive(const RunRequest& request);

}  // namespace vergence::app
