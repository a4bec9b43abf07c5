#pragma once
#include <optional>

#include <csignal>

#include "app/runtime/errors.hpp"

namespace vergence::app {

/// SIGINT and SIGTERM become a flag that a command looks at between frames: it stops, closes its session and
/// returns stop_code().
///
/// Ownership  One at a time in a program; the destructor puts the former handlers back.
/// Threads    stop_requested() and stop_code() from any thread.
/// Errors     A second signal of the same kind ends the program at once, as it would without this: the way out of a hang.
class SignalGuard {
 public:
  SignalGuard();
  ~SignalGuard();
  SignalGuard(const SignalGuard&) = delete;
  SignalGuard& operator=(const SignalGuard&) = delete;

  [[nodiscard]] bool stop_requested() const noexcept;
  /// `interrupted` (130) or `terminated` (143) by the first signal that came; nothing when none did.
  [[nodiscard]] std::optional<ExitCode> stop_code() const noexcept;

 private:
  struct sigaction former_interrupt_ {};
  struct sigaction former_terminate_ {};
};

}  // namespace vergence::app
