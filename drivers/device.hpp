#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "core/types/time.hpp"

/// Common parts of cameras, INS and trigger boards.
namespace vergence {

/// Nanoseconds of a device's own clock, unwrapped by its driver. Origin and rate are the device's:
/// a ClockMapper ties it to the host.
using DeviceStamp = Instant<struct DeviceClock>;

enum class DeviceStatus : std::uint8_t {
  ok,
  timeout,            // nothing came within the limit
  stopped,            // not streaming: stop() was called, or start() never
  ended,              // the source is finite and at its end (mock drive); no more will come
  disconnected,       // unplugged, powered off, no answer; start() may bring it back
  not_found,          // no device with that serial
  no_permission,      // the system does not let us
  busy,               // somebody else has it
  unsupported,        // the device cannot do what was asked (size, rate, trigger)
  bad_configuration,  // an impossible value was requested: zero rate, negative exposure
  no_bandwidth,       // the bus has no room for this stream
  failed,             // the system or the device refused for another reason
};
[[nodiscard]] std::string_view to_string(DeviceStatus) noexcept;

/// Identity of a device for lists and messages.
struct DeviceInfo {
  std::string driver;  // mock, gige, …
  std::string serial;
  std::string model;
  std::string place;  // address, port, bus path
};

/// Timing of the path from measurement to host, for the configuration in
/// force.
struct DeviceTiming {
  Duration min_delay{};  // from the stamped instant to the arrival, at best
  Duration delay_spread = Duration::milliseconds(2);  // by how much a delay usually exceeds it
  Duration resolution = Duration::microseconds(1);    // of the device's stamps
};

/// Callback of a driver when something can be taken. One Notifier may serve several devices.
///
/// Threads  notify() from the driver's threads, at any time between start() and the return of
///          stop(); it neither blocks nor calls back.
class Notifier {
 public:
  virtual ~Notifier() = default;
  virtual void notify() noexcept = 0;
};

}  // namespace vergence
