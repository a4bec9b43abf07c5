#pragma once
#include <array>
#include <csignal>
#include <optional>

#include "app/runtime/errors.hpp"

namespace vergence::app {

/// Turns SIGINT and SIGTERM into a flag that a command checks between frames; it then closes its
/// session and returns stop_code(). SIGHUP does the same unless it was ignored before (nohup).
/// SIGUSR1 requests a calibration, if the command supports it. SIGPIPE, SIGXFSZ and SIGUSR2 are
/// ignored, because they would end a run without its summary and report.
///
/// One object at a time; the destructor restores the former handlers. Other calls are thread-safe.
/// A second signal of the same kind ends the program immediately, as a way out of a hang.
class SignalGuard {
 public:
  SignalGuard();
  ~SignalGuard();
  SignalGuard(const SignalGuard&) = delete;
  SignalGuard& operator=(const SignalGuard&) = delete;

  [[nodiscard]] bool stop_requested() const noexcept;
  /// `interrupted` (130) or `terminated` (143, also for SIGHUP) by the first signal; empty if there
  /// was none.
  [[nodiscard]] std::optional<ExitCode> stop_code() const noexcept;
  /// Returns true if SIGUSR1 was received since the last call.
  [[nodiscard]] bool poll_calibration_request() const noexcept;

 private:
  // Former actions in the order of installation.
  std::array<struct sigaction, 7> former_{};
};

}  // namespace vergence::app
