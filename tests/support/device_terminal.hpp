#pragma once
#include <fcntl.h>
#include <poll.h>
#include <stdlib.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>

#include "drivers/clock.hpp"
#include "tests/support/simulators/device_model.hpp"

namespace vergence::test {

/// A simulated device in real time on a descriptor: the far end of a serial line.
///
/// Ownership  Takes the descriptor and the device. Threads: one of its own, on which alone the
///            device is used, from construction to
/// destruction.
class DeviceOnDescriptor {
 public:
  DeviceOnDescriptor(int descriptor, std::unique_ptr<DeviceModel> device)
      : descriptor_(descriptor), device_(std::move(device)) {
    if (descriptor_ < 0) throw std::runtime_error("no terminal for the simulated device");
    thread_ = std::thread([this] { work(); });
  }
  DeviceOnDescriptor(const DeviceOnDescriptor&) = delete;
  DeviceOnDescriptor& operator=(const DeviceOnDescriptor&) = delete;
  ~DeviceOnDescriptor() {
    stop_ = true;
    thread_.join();
    ::close(descriptor_);
  }

 private:
  void work() {
    while (!stop_) {
      std::vector<std::uint8_t> out;
      for (auto next = device_->next(); next && *next <= monotonic_now(); next = device_->next())
        device_->produce(monotonic_now(), &out);
      if (!out.empty())
        // An unread line drops bytes.
        (void)!::write(descriptor_, out.data(), out.size());
      pollfd p{descriptor_, POLLIN, 0};
      if (::poll(&p, 1, patience()) <= 0) continue;
      std::array<std::uint8_t, 512> in{};
      const ssize_t n = ::read(descriptor_, in.data(), in.size());
      if (n > 0)
        device_->receive(std::span(in).first(static_cast<std::size_t>(n)), monotonic_now());
      else
        // While the other end is closed poll() does not wait.
        ::usleep(1000);
    }
  }
  /// Until the device has something to say, in ms: a rig's kernel has better to do than to wake it
  /// for nothing.
  [[nodiscard]] int patience() const {
    // Short enough for stop_ to be seen.
    constexpr std::int64_t kLongest = 20;
    const auto next = device_->next();
    if (!next) return kLongest;
    return static_cast<int>(
        std::clamp<std::int64_t>((*next - monotonic_now()).ns() / 1'000'000, 1, kLongest));
  }

  int descriptor_;
  std::unique_ptr<DeviceModel> device_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

/// Variant behind a pseudo-terminal: port() is what a driver opens.
class DeviceOnTerminal {
 public:
  explicit DeviceOnTerminal(std::unique_ptr<DeviceModel> device)
      : master_(::posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK)) {
    if (master_ < 0 || ::grantpt(master_) != 0 || ::unlockpt(master_) != 0)
      throw std::runtime_error("no pseudo-terminal");
    port_ = ::ptsname(master_);
    device_ = std::make_unique<DeviceOnDescriptor>(master_, std::move(device));
  }
  [[nodiscard]] const std::string& port() const noexcept { return port_; }

 private:
  int master_;
  std::string port_;
  std::unique_ptr<DeviceOnDescriptor> device_;
};

}  // namespace vergence::test
