#include "app/runtime/service_manager.hpp"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <condition_variable>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <mutex>
#include <string_view>

#include <fmt/format.h>

namespace vergence::app {
namespace {

constexpr int kSigns = 3;  // of life in an interval of the watchdog
constexpr std::chrono::nanoseconds kUnwatched = std::chrono::seconds(1);  // between two otherwise
constexpr std::chrono::minutes kLongestClosing{10};
constexpr const char* kMoreTime = "WATCHDOG=1\nEXTEND_TIMEOUT_USEC=60000000";

std::string environment(const char* name) {
  const char* value = std::getenv(name);
  return value != nullptr ? value : "";
}

/// WATCHDOG_USEC, if it is meant for this process.
std::chrono::nanoseconds watchdog_of_environment() {
  const std::string pid = environment("WATCHDOG_PID"), text = environment("WATCHDOG_USEC");
  if (!pid.empty() && pid != std::to_string(::getpid())) return {};
  std::int64_t us = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), us);
  constexpr std::int64_t kLongest = 3'600'000'000;  // an hour
  if (error != std::errc() || us <= 0) return {};
  return std::chrono::microseconds(std::min(us, kLongest));
}

}  // namespace

ServiceManager::ServiceManager()
    : ServiceManager(environment("NOTIFY_SOCKET"), watchdog_of_environment()) {}

ServiceManager::ServiceManager(const std::string& socket, std::chrono::nanoseconds watchdog)
    : socket_(socket), interval_(watchdog / kSigns) {
  sockaddr_un address;
  const bool known = !socket.empty() && (socket.front() == '/' || socket.front() == '@') &&
                     socket.size() < sizeof address.sun_path;
  if (known) fd_ = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
}

ServiceManager::~ServiceManager() {
  closing_ = {};  // its thread ends before what it sends to is closed
  if (fd_ >= 0) ::close(fd_);
}

void ServiceManager::send(const std::string& lines) noexcept {
  if (fd_ < 0) return;
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::memcpy(address.sun_path, socket_.data(), socket_.size());  // its size was checked
  if (socket_.front() == '@') address.sun_path[0] = '\0';
  const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + socket_.size());
  (void)::sendto(fd_, lines.data(), lines.size(), MSG_NOSIGNAL,
                 reinterpret_cast<const sockaddr*>(&address), size);
}

void ServiceManager::alive(std::uint64_t beats, std::uint64_t items,
                           std::chrono::steady_clock::time_point now) noexcept {
  if (fd_ < 0 || beats == beats_) return;
  const bool watched = interval_.count() > 0;
  const std::chrono::nanoseconds interval = watched ? interval_ : kUnwatched;
  if (any_ && now - last_ < interval) return;
  any_ = true;
  last_ = now;
  beats_ = beats;
  send(fmt::format("{}STATUS={} frames, readings and events handled", watched ? "WATCHDOG=1\n" : "",
                   items));
}

void ServiceManager::stopping() noexcept {
  if (fd_ < 0 || closing_.joinable()) return;
  send("STOPPING=1\nWATCHDOG=1");
  const std::chrono::nanoseconds interval = interval_.count() > 0 ? interval_ : kUnwatched;
  try {
    closing_ = std::jthread([this, interval](const std::stop_token& end) {
      std::mutex mutex;
      std::condition_variable_any ended;
      std::unique_lock lock(mutex);
      const auto last = std::chrono::steady_clock::now() + kLongestClosing;
      while (std::chrono::steady_clock::now() < last) {
        send(kMoreTime);
        if (ended.wait_for(lock, end, interval, [&end] { return end.stop_requested(); })) return;
      }
    });
  } catch (const std::exception&) {  // no thread: the limits of the unit hold
  }
}

}  // namespace vergence::app
