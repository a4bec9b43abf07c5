#pragma once
#include "app/publish/line_publisher.hpp"
#include "app/publish/live_page.hpp"
#include "app/session/session_runner.hpp"

namespace vergence::app {

/// Interfaces of a running session, configured by `publish` (docs/live_interface.md).
///
/// Must outlive the session that gets its observers. Starts one thread each for lines and page.
/// Throws InputError for invalid addresses. If the machine refuses one (port in use, missing
/// directory), a message goes to stderr and the session runs without it.
class Publishing {
 public:
  /// With `page`, serves the live page on this machine if no address is configured. Gives *session
  /// its observers and requests, and prints the page's address on stderr.
  Publishing(bool page, Configuration* configuration, SessionOptions* session);

 private:
  void open_page(const Configuration& configuration);

  SessionRequests requests_;
  std::unique_ptr<SessionObserver> lines_, page_;
};

}  // namespace vergence::app
