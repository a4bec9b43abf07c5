#pragma once
#include <cstdint>
#include <string>
#include <string_view>

#include "core/types/time.hpp"

/// Types shared by cameras, INS and trigger boards.
namespace vergence {

/// Nanoseconds of a device's own clock, unwrapped by its driver. Origin and rate are those of the
/// device; a ClockMapper maps the stamp to the host's clock.
using DeviceStamp = Instant<struct DeviceClock>;

enum class DeviceStatus : std::uint8_t {
  ok,
  /// No data arrived within the limit.
  timeout,
  /// Not streaming: stop() was called, or start() never was.
  stopped,
  /// A finite source (a simulated drive) is at its end; no more data follows.
  ended,
  /// Unplugged, powered off or unresponsive; start() may reconnect.
  disconnected,
  /// No device has that serial number.
  not_found,
  /// The system denies access.
  no_permission,
  /// The device is in use by another program.
  busy,
  /// The device does not support the request (size, rate, trigger).
  unsupported,
  /// An impossible value was requested: zero rate, negative exposure.
  bad_configuration,
  /// The bus has too little bandwidth left for this stream.
  no_bandwidth,
  /// The system or the device refused for another reason.
  failed,
};
[[nodiscard]] std::string_view to_string(DeviceStatus) noexcept;

/// Identity of a device for lists and messages.
struct DeviceInfo {
  /// Name of the driver: mock, gige, …
  std::string driver;
  std::string serial;
  std::string model;
  /// Address, port or bus path.
  std::string place;
};

/// Timing of the path from measurement to host, for the current configuration.
struct DeviceTiming {
  /// Minimum delay from the stamped instant to the arrival.
  Duration min_delay{};
  /// Usual excess of a delay over the minimum.
  Duration delay_spread = Duration::milliseconds(2);
  /// Resolution of the device's stamps.
  Duration resolution = Duration::microseconds(1);
};

/// Callback of a driver when new data can be read. One Notifier may serve several devices.
///
/// notify() runs on the driver's threads, at any time between start() and the return of stop(). It
/// must not block or call the driver.
class Notifier {
 public:
  virtual ~Notifier() = default;
  virtual void notify() noexcept = 0;
};

}  // namespace vergence
