#pragma once
#include "app/runtime/signals.hpp"
#include "app/session/frame_source.hpp"

namespace vergence::app {

/// Output options of a session.
struct SessionOptions {
  std::filesystem::path out;
  bool quiet = false;
  /// Prints a table of the memory on stdout.
  bool print_memory = false;
  std::vector<SessionObserver*> observers{};
  /// Requests of observers; may be null.
  SessionRequests* requests = nullptr;
};

/// Processes a source by estimator and comparison into a session directory: set-up, monitoring,
/// events, comparison, summary, report and result, equal for devices and recordings.
///
///     const std::unique_ptr<FrameSource> source = …;
///     SessionOptions options;
///     options.out = "sessions/monday";
///     const ExitCode code = run_session(*source, request.configuration, options, signals);
///
/// Threads  The source's own, the estimator (sealed, with comparison and observers), its worker,
///          the calibration solver (sealed) and the recorder. The caller's thread draws the
///          progress line and watches for signals.
/// Errors   Throws InputError before the directory is made, as far as possible, and if the source
///          does not start. Later errors are messages on stderr. A full, read-only or unresponsive
///          disk does not stop a live run; the directory is made when the disk allows it.
/// Returns  done, not_usable (no pose, an INS without a position), device_failed (the source's
///          result), not_written (a missing or incomplete file), interrupted, terminated
[[nodiscard]] ExitCode run_session(FrameSource& source, const Configuration& configuration,
                                   const SessionOptions& options, const SignalGuard& signals);

}  // namespace vergence::app
