#pragma once
#include <chrono>
#include <cstdint>
#include <string>
#include <thread>

namespace vergence::app {

/// Reports the program's state to systemd: ready, alive, stopping (sd_notify(3)). Does nothing
/// without NOTIFY_SOCKET in the environment. One caller; stopping() starts an own thread.
class ServiceManager {
 public:
  /// Reads the environment of the process.
  ServiceManager();

  void ready() noexcept { send("READY=1"); }
  /// Last call; repeated calls have no effect. What follows, such as the report of a long run, may
  /// exceed the watchdog's interval and the unit's TimeoutStopSec, so notifications that request
  /// more time continue until the end, for at most ten minutes.
  void stopping() noexcept;
  /// Reports the health of a loop that handles items. It is alive if it handles items, or waits for
  /// one while the devices' thread iterates: cameras may be disconnected and the run continue. If a
  /// device blocks that thread, `rounds` does not change. A loop that was alive since the last
  /// notification is reported three times per watchdog interval.
  void alive(std::uint64_t items, bool waiting, std::uint64_t rounds,
             std::chrono::steady_clock::time_point now) noexcept;

 private:
  void send(const std::string& lines) noexcept;

  bool asked_ = false;
  // Interval of notifications; zero if none are requested.
  std::chrono::nanoseconds interval_{};
  // Iterations of the devices' thread, and those during which the loop waited.
  std::uint64_t rounds_ = 0, idle_ = 0;
  // Value at the last notification.
  std::uint64_t beats_ = 0;
  std::chrono::steady_clock::time_point last_{};
  bool any_ = false;
  // Last member, because it uses the others.
  std::jthread closing_;
};

}  // namespace vergence::app
