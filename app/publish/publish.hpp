#pragma once
#include <memory>
#include <string>

#include "app/config/configuration.hpp"
#include "app/publish/line_publisher.hpp"
#include "app/publish/live_page.hpp"
#include "app/session/session_runner.hpp"

namespace vergence::app {

/// `publish:` of the configuration: what others see of a running session (docs/live_interface.md).
///
/// Ownership  Outlives the session that its observers are given to.
/// Threads    One each for lines and page, begun here. Memory: theirs, taken here.
/// Errors     Addresses that are none: InputError. What this machine refuses (a port in use, a
///            folder that is not there): a message on stderr, and the session goes without.
class Publishing {
 public:
  explicit Publishing(const Configuration& configuration);

  /// Its observers and what viewers ask for; says on stderr where the page is.
  void attach(SessionOptions* session);

 private:
  void open_page(const Configuration& configuration);

  SessionRequests requests_;
  std::unique_ptr<LinePublisher> lines_;  // outlives the page, which shows its latency
  std::unique_ptr<SessionObserver> page_;
  std::string link_{};  // to the page, for a person to open
};

/// `--live-page`: the live page on this machine, where the configuration names no address.
void page_by_default(Configuration* configuration);

}  // namespace vergence::app
