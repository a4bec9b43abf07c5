#pragma once
#include <algorithm>
#include <chrono>
#include <cstdint>

#include "drivers/device.hpp"

namespace vergence {

/// When a disconnected device is restarted.
enum class Reconnect : std::uint8_t {
  /// At most once per second.
  paced,
  /// At each poll: virtual time, in which a pause would depend on the machine's speed.
  at_each_poll,
};

/// Oldest unconsumed item of a device and its connection state: a common way to poll cameras, INS
/// and trigger board.
///
/// The device must outlive it. Only the acquisition's thread calls it.
template <class Device, class Value>
struct DeviceHead {
  /// Minimum interval of reconnection attempts, ns: opening a bus device takes time.
  static constexpr std::int64_t kRetryIntervalNs = 1'000'000'000;
  /// Minimum pause after an attempt, as a multiple of its duration; the data of other devices wait
  /// during one.
  static constexpr std::int64_t kMinPauseFactor = 10;

  Device* device = nullptr;
  /// True while `value` waits to be consumed.
  bool held = false;
  /// With `held`: the item is a disconnect at value.arrival.
  bool event = false;
  bool disconnected = false;
  /// True after a restart that is not reported yet.
  bool reconnected = false;
  bool ended = false;
  /// Pulses reported since the newest frame of a camera.
  std::int64_t pulses_without = 0;
  /// Time of the next reconnection attempt, steady clock.
  std::int64_t next_attempt_ns = 0;
  Value value{};

  /// Polls the device. A restarted device notifies `ready`.
  void poll(Notifier* ready, Reconnect reconnect) {
    if (device == nullptr) ended = true;
    if (held || ended || (disconnected && !start_again(ready, reconnect))) return;
    const DeviceStatus status = device->wait(Duration{}, &value);
    event = status == DeviceStatus::disconnected;
    held = status == DeviceStatus::ok || event;
    ended = status == DeviceStatus::ended || status == DeviceStatus::stopped;
  }

 private:
  [[nodiscard]] bool start_again(Notifier* ready, Reconnect reconnect) {
    const auto now = [] { return std::chrono::steady_clock::now().time_since_epoch().count(); };
    const std::int64_t begun = now();
    if (reconnect == Reconnect::paced && begun < next_attempt_ns) return false;
    const DeviceStatus status = device->start(ready);
    const std::int64_t done = now();
    next_attempt_ns = done + std::max(kRetryIntervalNs, kMinPauseFactor * (done - begun));
    ended = status == DeviceStatus::ended;
    if (status != DeviceStatus::ok) return false;
    disconnected = false;
    reconnected = true;
    return true;
  }
};

}  // namespace vergence
