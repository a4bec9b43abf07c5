#pragma once
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "core/types/ins_sample.hpp"
#include "drivers/device.hpp"

namespace vergence {

/// Status of a device and its receiver next to the sample.
struct InsQuality {
  /// Status word of the device; its protocol's header has the bits.
  std::uint32_t status = 0;
  /// True if the device has UTC, with leap seconds.
  bool utc_valid = false;
  /// UTC of the sample in ns since 1970; 0 if unknown.
  std::int64_t utc_ns = 0;
  /// Number of satellites used; 0 if unknown.
  std::uint8_t satellites = 0;
  /// Dilution of precision of the position; 0 if unknown.
  float position_dop = 0;
  bool filter_valid = false;
  /// True if a pulse left SyncOut with this sample.
  bool sync_out = false;
};

/// One reading on the session's clock: stamp and error bound are set. Plain, goes through rings.
struct InsRecord {
  InsSample sample{};
  InsQuality quality{};  // `status` is the device's, or the data set's, own word
};

/// One reading as it came. `sample.stamp` and `sample.stamp_error` are not set yet: the host's
/// clock is tied to Unix time elsewhere.
struct InsReading {
  InsSample sample{};
  InsQuality quality{};
  /// Time of the measurement by the INS's clock, unwrapped; it increases until a disconnect.
  DeviceStamp measured{};
  /// Time when the last byte arrived.
  HostStamp arrival{};
  /// True for the first reading after a pause().
  bool resumed = false;
  // A driver with the time of each byte on the wire maps the stamp itself; else a
  // ClockMapper does, from `arrival`.
  bool mapped = false;
  /// `measured` on the host's clock.
  HostStamp host{};
  /// Upper bound of |true − host|.
  Duration host_error{};
};

/// Counters since open; all only grow.
struct InsStatistics {
  std::uint64_t delivered = 0;
  /// Gaps in the device's count.
  std::uint64_t lost = 0;
  /// Packets that could not be decoded.
  std::uint64_t malformed = 0;
  /// Restarts of the device and steps of its clock.
  std::uint64_t restarts = 0;
  /// Readings dropped because the ring was full (live only).
  std::uint64_t overruns = 0;
  std::uint64_t starts = 0;
};

/// One opened inertial navigation system with satellite receiver.
///
///     if (ins.configure(100, nullptr) != DeviceStatus::ok) return;  // ins.last_error()
///     if (ins.start(nullptr) != DeviceStatus::ok) return;
///     for (InsReading reading; ins.wait(Duration::seconds(1), &reading) == DeviceStatus::ok;)
///       use(reading.sample, reading.mapped ? reading.host
///                                          : mapper.map(reading.measured, reading.arrival).host);
///
/// Ownership  Values; nothing to give back.
/// Threads    configure, start, stop: the owner's thread. wait: one consumer thread; it may overlap
///            stop(). statistics: any.
/// Memory     No allocation by the caller's thread between start() and stop().
/// Full       A reading that finds no room is dropped and counted; a mock in virtual time waits
///            instead.
/// Errors     Nothing throws. A call that is not `ok` has changed nothing but the counters and
///            reading->arrival.
class InsDevice {
 public:
  virtual ~InsDevice() = default;  // stops

  [[nodiscard]] virtual const DeviceInfo& info() const noexcept = 0;
  /// Readings a second. *actual_hz (may be null): what it will do. → ok, unsupported,
  /// bad_configuration, disconnected
  [[nodiscard]] virtual DeviceStatus configure(double rate_hz, double* actual_hz) noexcept = 0;
  /// From the measurement to its arrival. Precondition: configured.
  [[nodiscard]] virtual DeviceTiming timing() const noexcept = 0;
  /// As CameraDevice::start().
  [[nodiscard]] virtual DeviceStatus start(Notifier* ready) noexcept = 0;
  /// Oldest reading not yet taken, in the order of measurement, waiting at most `limit` (0: look
  /// once). `disconnected`: reading->arrival says when it was noticed. → ok, timeout, stopped,
  /// ended, disconnected
  [[nodiscard]] virtual DeviceStatus wait(Duration limit, InsReading* reading) noexcept = 0;
  virtual void stop() noexcept = 0;
  /// While it streams: makes neither readings nor pulses (SyncOut) for so long, as soon as it can;
  /// no reading before or after is lost for it. Does not wait. Any thread. → ok, unsupported,
  /// stopped
  [[nodiscard]] virtual DeviceStatus pause(Duration /*gap*/) noexcept {
    return DeviceStatus::unsupported;
  }
  /// One message about the last call that was not `ok`: what was refused, what to do. Empty: the
  /// status says it all. Owner's thread; may allocate.
  [[nodiscard]] virtual std::string last_error() const { return {}; }
  /// One message about what works, but not as asked. Empty: nothing. As last_error().
  [[nodiscard]] virtual std::string remark() const { return {}; }
  [[nodiscard]] virtual InsStatistics statistics() const noexcept = 0;
};

/// One kind of INS: a row in the table of drivers. As CameraDriver.
class InsDriver {
 public:
  virtual ~InsDriver() = default;
  [[nodiscard]] virtual std::vector<DeviceInfo> enumerate() = 0;
  [[nodiscard]] virtual std::unique_ptr<InsDevice> open(std::string_view serial,
                                                        DeviceStatus* status) = 0;
  /// One message about the last open() that gave nothing. Empty: the status says it all.
  [[nodiscard]] virtual std::string last_error() const { return {}; }
};

}  // namespace vergence
