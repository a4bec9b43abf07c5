#include "app/session/live_session.hpp"

#include <memory>

#include "app/session/live_source.hpp"

namespace vergence::app {

ExitCode run_drive(const RunRequest& request) {
  const SignalGuard signals(
      SignalGuard::OnHangup::reopen);  // before a mock's world is built, which takes seconds
  const auto source = in_words([&] { return std::make_unique<LiveSource>(request); });
  return run_session(*source, request.configuration, request.session, signals);
}

}  // namespace vergence::app
