#pragma once
#include <chrono>
#include <cstdint>
#include <string>
#include <thread>

namespace vergence::app {

/// Tells systemd how the program does: ready, a line of status, alive, stopping (sd_notify(3)).
/// Without NOTIFY_SOCKET in the environment every call does nothing.
///
/// Threads  One caller, and from stopping() on one of its own.
class ServiceManager {
 public:
  /// From the environment of the process.
  ServiceManager();
  ServiceManager(const ServiceManager&) = delete;
  ServiceManager& operator=(const ServiceManager&) = delete;

  void ready() noexcept { send("READY=1"); }
  /// The last call; again: nothing. What follows, a report of a day's drive above all, may take
  /// longer than the watchdog's interval and the unit's TimeoutStopSec: signs of life that ask for
  /// more time go out until the end, ten minutes at most.
  void stopping() noexcept;
  /// Health of a loop that handles items. It is alive when it handles some, and also when it waits
  /// for the next one while the devices' thread goes round: the cameras may be gone and the drive
  /// go on. A thread that a device holds up does not go round (`rounds` stays the same). A sign of
  /// life goes out three times in a watchdog's interval, of a loop that was alive since the last.
  void alive(std::uint64_t items, bool waiting, std::uint64_t rounds,
             std::chrono::steady_clock::time_point now) noexcept;

 private:
  void send(const std::string& lines) noexcept;

  bool asked_ = false;
  std::chrono::nanoseconds interval_{};  // between two signs of life; zero: none is wanted
  std::uint64_t rounds_ = 0, idle_ = 0;  // of the devices' thread; those while the loop waited
  std::uint64_t beats_ = 0;              // at the last sign of life
  std::chrono::steady_clock::time_point last_{};
  bool any_ = false;
  std::jthread closing_;  // last: it uses the others
};

}  // namespace vergence::app
