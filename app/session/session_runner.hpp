#pragma once
#include <filesystem>
#include <stdexcept>
#include <vector>

#include "app/config/configuration.hpp"
#include "app/runtime/errors.hpp"
#include "app/runtime/signals.hpp"
#include "app/session/frame_source.hpp"
#include "app/session/session_observer.hpp"

namespace vergence::app {

/// Output options of a session.
struct SessionOptions {
  std::filesystem::path out;
  bool quiet = false;
  bool print_memory = false;  // a table of what is held, on stdout
  std::vector<SessionObserver*> observers{};
  SessionRequests* requests = nullptr;  // from observers; may be null
};

/// Runs a source through estimator and comparison into a session folder: set-up,
/// watching, events, comparison, summary, report and verdict, the same for devices and recordings.
///
///     const auto source = make_recorded_source(request, …);
///     SessionOptions options;
///     options.out = "sessions/monday";
///     const ExitCode code = run_session(*source, request.configuration, options, signals);
///
/// Threads  The source's own, the estimator (sealed, with the comparison and the observers), its
///          worker, the calibration solver (sealed, too), the recorder; the caller's thread draws
///          the progress line and watches for signals.
/// Errors   InputError before the session folder is made, for all that can be known by then, and
///          where the source does not start. Afterwards messages on stderr. A disk that is full,
///          read-only or silent holds up no live drive: the folder is made when it takes one.
/// → done, not_usable (never a pose, an INS that never had a position), device_failed (the source's
///   verdict), not_written (a file is missing or not whole), interrupted, terminated
[[nodiscard]] ExitCode run_session(FrameSource& source, const Configuration& configuration,
                                   const SessionOptions& options, const SignalGuard& signals);

/// Returns the result of `make`. Turns std::invalid_argument and std::length_error, by which core
/// refuses options and rig that do not fit together, into an InputError with the same message.
template <class Make>
auto with_plain_errors(const Make& make) {
  try {
    return make();
  } catch (const std::invalid_argument& e) {
    throw InputError(e.what());
  } catch (const std::length_error& e) {
    throw InputError(e.what());
  }
}

}  // namespace vergence::app
