#pragma once
#include <fcntl.h>
#include <poll.h>
#include <stdlib.h>
#include <time.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "drivers/mock/simulators/xsens_simulator.hpp"

namespace vergence::test {

[[nodiscard]] inline HostStamp monotonic_now() {
  timespec t{};
  (void)::clock_gettime(CLOCK_MONOTONIC, &t);
  return HostStamp(t.tv_sec * 1'000'000'000 + t.tv_nsec);
}

/// A simulated XSens INS in real time on a descriptor: the far end of a serial line. It stands still, with a fix.
///
/// Ownership  Takes the descriptor. Threads: one of its own, from construction to destruction.
class XsensOnDescriptor {
 public:
  XsensOnDescriptor(int descriptor, mock::XsensSimulatorOptions options) : descriptor_(descriptor) {
    if (descriptor_ < 0) throw std::runtime_error("no terminal for the simulated INS");
    options.power_on = monotonic_now();
    sensor_ = std::make_unique<mock::XsensSimulator>(
        [](std::uint64_t number, Duration /*time*/) {
          InsSample s;
          s.number = number;
          s.fix = FixStatus::fix_3d;
          s.attitude_valid = s.velocity_valid = true;
          s.position = {-27.4975, 153.0137, 60};
          return s;
        },
        options);
    thread_ = std::thread([this] { work(); });
  }
  XsensOnDescriptor(const XsensOnDescriptor&) = delete;
  XsensOnDescriptor& operator=(const XsensOnDescriptor&) = delete;
  ~XsensOnDescriptor() {
    stop_ = true;
    thread_.join();
    ::close(descriptor_);
  }

 private:
  void work() {
    while (!stop_) {
      std::vector<std::uint8_t> out;
      for (auto next = sensor_->next(); next && *next <= monotonic_now(); next = sensor_->next()) sensor_->produce(monotonic_now(), &out);
      if (!out.empty()) (void)!::write(descriptor_, out.data(), out.size());  // a line that nobody reads drops bytes
      pollfd p{descriptor_, POLLIN, 0};
      if (::poll(&p, 1, 1) <= 0) continue;
      std::array<std::uint8_t, 512> in{};
      const ssize_t n = ::read(descriptor_, in.data(), in.size());
      if (n > 0)
        sensor_->receive(std::span(in).first(static_cast<std::size_t>(n)), monotonic_now());
      else
        ::usleep(1000);  // nobody has the other end open: poll() does not wait
    }
  }
  int descriptor_;
  std::unique_ptr<mock::XsensSimulator> sensor_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

/// The same behind a pseudo-terminal: port() is what a driver opens.
class XsensOnTerminal {
 public:
  explicit XsensOnTerminal(const mock::XsensSimulatorOptions& options) : master_(::posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK)) {
    if (master_ < 0 || ::grantpt(master_) != 0 || ::unlockpt(master_) != 0) throw std::runtime_error("no pseudo-terminal");
    port_ = ::ptsname(master_);
    sensor_ = std::make_unique<XsensOnDescriptor>(master_, options);
  }
  [[nodiscard]] const std::string& port() const noexcept { return port_; }

 private:
  int master_;
  std::string port_;
  std::unique_ptr<XsensOnDescriptor> sensor_;
};

}  // namespace vergence::test
