#include "app/runtime/progress_output.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <climits>

#include <fmt/format.h>

namespace vergence::app {
namespace {

constexpr std::chrono::milliseconds kPatience{1000};

}  // namespace

ProgressOutput::ProgressOutput(int fd) : fd_(fd) {
  struct stat status {};
  if (::fstat(fd, &status) != 0) return;
  if (S_ISSOCK(status.st_mode)) kind_ = Kind::socket;
  if (!S_ISFIFO(status.st_mode) && ::isatty(fd) != 1) return;
  const int again = ::open(fmt::format("/proc/self/fd/{}", fd).c_str(),
                           O_WRONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC);
  own_ = again >= 0;
  if (own_)
    fd_ = again;
  else
    kind_ = Kind::asks;
}

ProgressOutput::~ProgressOutput() {
  std::string_view rest = rest_;
  (void)push(&rest, true);
  if (own_) (void)::close(fd_);
}

bool ProgressOutput::writable(int timeout_ms) const {
  pollfd asked{fd_, POLLOUT, 0};
  return ::poll(&asked, 1, timeout_ms) > 0;  // one that failed, too: it holds nobody up
}

bool ProgressOutput::push(std::string_view* text) {
  while (!text->empty()) {
    if (kind_ == Kind::asks && !writable(0)) return false;
    const std::size_t piece = kind_ == Kind::asks ? PIPE_BUF : text->size();
    const std::size_t size = std::min(piece, text->size());
    const ssize_t n = kind_ == Kind::socket
                          ? ::send(fd_, text->data(), size, MSG_DONTWAIT | MSG_NOSIGNAL)
                          : ::write(fd_, text->data(), size);
    if (n > 0)
      text->remove_prefix(static_cast<std::size_t>(n));
    else if (n < 0 && (errno == EAGAIN || errno == EWOULDBLOCK))
      return false;
    else if (n == 0 || errno != EINTR)
      *text = {};
  }
  return true;
}

bool ProgressOutput::push(std::string_view* text, bool may_wait) {
  using Clock = std::chrono::steady_clock;
  if (text->empty()) return true;
  const auto end = Clock::now() + (may_wait && !stuck_ ? kPatience : Clock::duration::zero());
  while (!push(text)) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(end - Clock::now()).count();
    if (left > 0 && writable(static_cast<int>(left))) continue;
    stuck_ = stuck_ || may_wait;
    return false;
  }
  stuck_ = false;
  return true;
}

bool ProgressOutput::write(std::string_view text, bool may_wait) {
  std::string_view before = rest_;
  const bool clear = push(&before, may_wait);
  rest_.erase(0, rest_.size() - before.size());
  if (!clear) return false;
  const std::size_t size = text.size();
  if (push(&text, may_wait)) return true;
  rest_ = text;
  if (text.size() < size) return true;
  rest_.clear();
  return false;
}

}  // namespace vergence::app
