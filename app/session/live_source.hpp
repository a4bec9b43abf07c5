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

/// Runs live on the cameras, INS and trigger board of the configuration and writes a session
/// directory (run_session()).
///
/// Errors   Throws InputError or DeviceError before the directory is made, as far as possible.
/// Later
///          errors are messages on stderr.
/// Returns  as run_session() does; device_failed if a camera was disconnected at the end.
[[nodiscard]] ExitCode run_drive(const RunRequest& request);

}  // namespace vergence::app
