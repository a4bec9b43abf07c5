#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "app/commands/starting_calibration.hpp"
#include "app/config/configuration.hpp"
#include "app/recorder/other_formats.hpp"
#include "app/runtime/errors.hpp"

namespace vergence::app {

/// What a drive is to do.
struct RunRequest {
  std::filesystem::path out;
  Configuration configuration;
  CalibrationSource calibration{};   // --from-scratch, --calibration
  std::vector<std::string> faults;   // of the command line, beside the configuration's
  std::optional<double> duration_s;  // all of the drive when not set
  bool fast = false;                 // virtual time: nothing is dropped for time
  std::vector<OtherFormat> also{};   // written beside the session's own files
  bool quiet = false;
  bool print_memory = false;
};

/// Drives: cameras, INS and board of the configuration through pairing, estimator and comparison
/// into a session folder (DESIGN §6).
///
/// Threads  The devices' own, the synchroniser's, the estimator (sealed, with the comparison), its
///          worker, the calibration solver's (sealed, too), the recorder; the caller's thread draws
///          the progress line and watches for signals.
/// Errors   InputError before the session folder is made, for all that can be known by then.
///          Afterwards sentences on stderr.
/// → done, not_usable (never a pose, an INS that never had a fix, a file that is not whole),
///   device_failed (gone at the end), interrupted, terminated
[[nodiscard]] ExitCode run_drive(const RunRequest& request);

}  // namespace vergence::app
