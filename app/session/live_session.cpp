#include "app/session/live_session.hpp"

#include <memory>

#include "app/runtime/errors.hpp"
#include "app/session/live_source.hpp"

namespace vergence::app {

ExitCode run_drive(const RunRequest& request) {
  const SignalGuard signals;  // before a mock's world is built, which takes seconds
  try {
    const auto source = in_words([&] { return std::make_unique<LiveSource>(request); });
    if (const auto stopped = signals.stop_code()) return *stopped;  // devices are opened in seconds
    return run_session(*source, request.configuration, request.session, signals);
  } catch (const DeviceError&) {
    // Who has stopped it does not miss the device.
    if (const auto stopped = signals.stop_code()) return *stopped;
    throw;
  }
}

}  // namespace vergence::app
