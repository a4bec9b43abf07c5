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
  std::uint32_t status = 0;     // the device's own word; bits in its protocol's header
  bool utc_valid = false;       // the device knows UTC, leap seconds too
  std::int64_t utc_ns = 0;      // of the sample, since 1970; 0: not told
  std::uint8_t satellites = 0;  // used; 0: not told
  float position_dop = 0;       // 0: not told
  bool filter_valid = false;
  bool sync_out = false;  // a pulse left SyncOut with this sample
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
  DeviceStamp measured{};  // by the INS's clock, unwrapped; grows while the device is not gone
  HostStamp arrival{};     // when the last byte was here
  bool resumed = false;    // the first after a pause()
  // A driver that knows how bytes travel (when each was on the wire) maps the stamp itself; else a
  // ClockMapper does, from `arrival`.
  bool mapped = false;
  HostStamp host{};       // `measured` on the host's clock
  Duration host_error{};  // |true − host| is below this
};

/// Counters since open; all only grow.
struct InsStatistics {
  std::uint64_t delivered = 0;
  std::uint64_t lost = 0;       // gaps in the device's count
  std::uint64_t malformed = 0;  // packets that made no sense
  std::uint64_t restarts = 0;   // the device restarted, or its clock was set
  std::uint64_t overruns = 0;   // readings that found the ring full (live); never silent
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
