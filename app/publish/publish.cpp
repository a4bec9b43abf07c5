#include "app/publish/publish.hpp"

#include <cstdio>

#include <fmt/format.h>

#include "app/runtime/errors.hpp"

namespace vergence::app {

Publishing::Publishing(const Configuration& configuration) {
  const PublishSettings& settings = configuration.publish;
  if (!settings.lines.empty()) {
    const LineAddress address = parse_line_address(settings.lines, "publish.lines");
    try {
      lines_ = std::make_unique<LinePublisher>(open_line_socket(address, "publish.lines"));
    } catch (const InputError& e) {
      fmt::print(stderr, "vergence: {}; the drive goes on without lines\n", e.what());
    }
  }
}

void Publishing::attach(SessionOptions* session) {
  if (lines_) session->observers.push_back(lines_.get());
  session->requests = &requests_;
}

}  // namespace vergence::app
