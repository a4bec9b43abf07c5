#pragma once
#include <chrono>
#include <cstdint>
#include <string>
#include <thread>

namespace vergence::app {

/// Tells systemd how the program does: ready, a line of status, alive, stopping. Where nobody asks
/// (no NOTIFY_SOCKET in the environment) every call does nothing.
///
/// Source   sd_notify(3): datagrams of `NAME=value` lines to the socket of NOTIFY_SOCKET ('@'
/// begins
///          an abstract name); WATCHDOG_USEC is how often a sign of life is wanted. systemd keeps
///          that protocol stable for programs without its library; libsystemd would bring a
///          compressor or five into a program that sends four words.
/// Threads  One caller, and from stopping() on one of its own. Never blocks: what the manager does
///          not take is dropped.
class ServiceManager {
 public:
  /// From the environment of the process.
  ServiceManager();
  /// `socket`: as NOTIFY_SOCKET; empty: nobody asks. `watchdog`: zero: no sign of life is wanted.
  ServiceManager(const std::string& socket, std::chrono::nanoseconds watchdog);
  ~ServiceManager();
  ServiceManager(const ServiceManager&) = delete;
  ServiceManager& operator=(const ServiceManager&) = delete;

  void ready() noexcept { send("READY=1"); }
  /// The last call; again: nothing. What follows, a report of a day's drive above all, may take
  /// longer than the watchdog's interval and the unit's TimeoutStopSec: signs of life that ask for
  /// more time go out until the end, ten minutes at most.
  void stopping() noexcept;
  /// `beats`: a number that changes while the estimator's loop is alive (Heartbeat). A sign of life
  /// goes out three times in a watchdog's interval, if it has changed since the last: not of a loop
  /// that hangs. `items`: how many it has handled, for the line of status.
  void alive(std::uint64_t beats, std::uint64_t items,
             std::chrono::steady_clock::time_point now) noexcept;

 private:
  void send(const std::string& lines) noexcept;

  int fd_ = -1;
  std::string socket_;
  std::chrono::nanoseconds interval_{};  // between two signs of life; zero: none is wanted
  std::uint64_t beats_ = 0;
  std::chrono::steady_clock::time_point last_{};
  bool any_ = false;
  std::jthread closing_;  // last: it uses the others
};

}  // namespace vergence::app
