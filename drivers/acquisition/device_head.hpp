#pragma once
#include <algorithm>
#include <chrono>
#include <cstdint>

#include "drivers/device.hpp"

namespace vergence {

/// The oldest item that a device has and nobody has taken, and whether the device is there: one
/// way to poll cameras, INS and board.
///
/// Ownership  The device outlives it. Threads: the acquisition's, which calls all of it.
template <class Device, class Value>
struct DeviceHead {
  static constexpr std::int64_t kAskAgain =
      1'000'000'000;  // ns: opening a bus device takes a while, a second more is no loss
  static constexpr std::int64_t kRest =
      10;  // times what asking took: meanwhile nobody takes what the other devices have

  Device* device = nullptr;
  bool held = false;   // `value` waits to be taken
  bool event = false;  // held: no value but that the device has gone, at value.arrival
  bool gone = false;
  bool back = false;  // it was started again, which nobody has been told yet
  bool ended = false;
  std::int64_t pulses_without = 0;  // reported, since a camera's newest frame
  std::int64_t ask_ns = 0;          // when it is next asked to come back, steady clock
  Value value{};

  /// `ready`: what a device that is started again notifies. `ask_always` (virtual time): a device
  /// that is gone is asked at each poll.
  void poll(Notifier* ready, bool ask_always) {
    if (device == nullptr) ended = true;
    if (held || ended || (gone && !start_again(ready, ask_always))) return;
    const DeviceStatus status = device->wait(Duration{}, &value);
    event = status == DeviceStatus::disconnected;
    held = status == DeviceStatus::ok || event;
    ended = status == DeviceStatus::ended || status == DeviceStatus::stopped;
  }

 private:
  [[nodiscard]] bool start_again(Notifier* ready, bool ask_always) {
    const auto now = [] { return std::chrono::steady_clock::now().time_since_epoch().count(); };
    const std::int64_t begun = now();
    if (!ask_always && begun < ask_ns) return false;
    const DeviceStatus status = device->start(ready);
    const std::int64_t done = now();
    ask_ns = done + std::max(kAskAgain, kRest * (done - begun));
    ended = status == DeviceStatus::ended;
    if (status != DeviceStatus::ok) return false;
    gone = false;
    back = true;
    return true;
  }
};

}  // namespace vergence
