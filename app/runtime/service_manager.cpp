#include "app/runtime/service_manager.hpp"

#include <systemd/sd-daemon.h>

#include <condition_variable>
#include <cstdlib>
#include <exception>
#include <mutex>

#include <fmt/format.h>

namespace vergence::app {
namespace {

// Number of watchdog messages per watchdog interval.
constexpr int kSigns = 3;
// Interval between messages if the unit has no watchdog.
constexpr std::chrono::nanoseconds kUnwatched = std::chrono::seconds(1);
constexpr std::chrono::minutes kLongestClosing{10};
constexpr const char* kMoreTime = "WATCHDOG=1\nEXTEND_TIMEOUT_USEC=60000000";

}  // namespace

ServiceManager::ServiceManager() : asked_(std::getenv("NOTIFY_SOCKET") != nullptr) {
  std::uint64_t us = 0;
  if (::sd_watchdog_enabled(0, &us) > 0) interval_ = std::chrono::microseconds(us) / kSigns;
}

void ServiceManager::send(const std::string& lines) noexcept {
  if (asked_) (void)::sd_notify(0, lines.c_str());
}

void ServiceManager::alive(std::uint64_t items, bool waiting, std::uint64_t rounds,
                           std::chrono::steady_clock::time_point now) noexcept {
  if (waiting && rounds != rounds_) ++idle_;
  rounds_ = rounds;
  const std::uint64_t beats = items + idle_;
  if (!asked_ || beats == beats_) return;
  const bool watched = interval_.count() > 0;
  const std::chrono::nanoseconds interval = watched ? interval_ : kUnwatched;
  if (any_ && now - last_ < interval) return;
  any_ = true;
  last_ = now;
  beats_ = beats;
  send(fmt::format("{}STATUS={} frames, samples and events processed",
                   watched ? "WATCHDOG=1\n" : "", items));
}

void ServiceManager::stopping() noexcept {
  if (!asked_ || closing_.joinable()) return;
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
  } catch (const std::exception&) {
    // Without a thread the limits of the unit apply.
  }
}

}  // namespace vergence::app
