#pragma once
#include <csignal>
#include <optional>

#include "app/runtime/errors.hpp"

namespace vergence::app {

/// SIGINT and SIGTERM become a flag that a command looks at between frames: it stops, closes its
/// session and returns stop_code(). SIGHUP does the same, unless it was ignored before (nohup).
/// SIGUSR1 asks for a new calibration; a command that has none to make takes no notice. SIGPIPE,
/// SIGXFSZ and SIGUSR2 are ignored: they would end a drive without its summary and report.
///
/// Ownership  One at a time in a program; the destructor puts the former handlers back.
/// Threads    All but construction and destruction from any thread.
/// Errors     A second signal of the same kind ends the program at once, as it would without this:
///            the way out of a hang.
class SignalGuard {
 public:
  SignalGuard();
  ~SignalGuard();
  SignalGuard(const SignalGuard&) = delete;
  SignalGuard& operator=(const SignalGuard&) = delete;

  [[nodiscard]] bool stop_requested() const noexcept;
  /// `interrupted` (130) or `terminated` (143; SIGHUP, too) by the first signal that came; nothing
  /// when none did.
  [[nodiscard]] std::optional<ExitCode> stop_code() const noexcept;
  /// Returns true if SIGUSR1 was received since the last call, however often.
  [[nodiscard]] bool poll_calibration_request() const noexcept;

 private:
  struct sigaction former_interrupt_ {};
  struct sigaction former_terminate_ {};
  struct sigaction former_user_ {};
  struct sigaction former_hangup_ {};
  struct sigaction former_pipe_ {};
  struct sigaction former_file_size_ {};
  struct sigaction former_user2_ {};
};

}  // namespace vergence::app
