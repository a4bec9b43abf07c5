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

/// Sample on the session's clock, with stamp and error bound set. Trivially copyable, so that it
/// can pass through rings.
struct InsRecord {
  InsSample sample{};
  /// Its `status` is the status word of the device or of the data set.
  InsQuality quality{};
};

/// Sample as received. `sample.stamp` and `sample.stamp_error` are not set yet, because the host's
/// clock is mapped to Unix time elsewhere.
struct InsReading {
  InsSample sample{};
  InsQuality quality{};
  /// Time of the measurement on the INS's clock, unwrapped; it increases until a disconnect.
  DeviceStamp measured{};
  /// Time when the last byte arrived.
  HostStamp arrival{};
  /// True for the first sample after a pause().
  bool resumed = false;
  // True if the driver set `host` itself, because it has the time of each byte on the wire.
  // Otherwise a ClockMapper derives `host` from `arrival`.
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
  /// Samples dropped because the ring was full (live only).
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
/// Ownership  Samples are values; nothing has to be released.
/// Threads    configure, start and stop belong to the owner's thread, wait to one consumer thread,
///            which may overlap stop(). statistics may be called from any thread.
/// Memory     The caller's threads do not allocate between start() and stop().
/// Full       A sample that finds no room is dropped and counted; a mock in virtual time waits
///            instead.
/// Errors     No call throws. A call that does not return `ok` changes only the counters and
///            reading->arrival.
class InsDevice {
 public:
  /// Stops the device.
  virtual ~InsDevice() = default;

  [[nodiscard]] virtual const DeviceInfo& info() const noexcept = 0;
  /// Sets the sample rate, in Hz. *actual_hz (may be null) receives the applied rate. → ok,
  /// unsupported, bad_configuration, disconnected
  [[nodiscard]] virtual DeviceStatus configure(double rate_hz, double* actual_hz) noexcept = 0;
  /// Delays from a measurement to its arrival. Precondition: configured.
  [[nodiscard]] virtual DeviceTiming timing() const noexcept = 0;
  /// Same contract as CameraDevice::start().
  [[nodiscard]] virtual DeviceStatus start(Notifier* ready) noexcept = 0;
  /// Returns the oldest sample not yet read, in order of measurement, and waits at most `limit`
  /// for it (0: does not wait). With `disconnected`, reading->arrival is the time when the
  /// disconnect was detected. → ok, timeout, stopped, ended, disconnected
  [[nodiscard]] virtual DeviceStatus wait(Duration limit, InsReading* reading) noexcept = 0;
  virtual void stop() noexcept = 0;
  /// Suspends samples and SyncOut pulses for the duration `gap`, as soon as possible; no other
  /// sample is lost. Does not block; any thread may call it while the device streams. → ok,
  /// unsupported, stopped
  [[nodiscard]] virtual DeviceStatus pause(Duration /*gap*/) noexcept {
    return DeviceStatus::unsupported;
  }
  /// Message about the last call that was not `ok`, with the fix; empty if the status is
  /// sufficient. Call from the owner's thread; may allocate.
  [[nodiscard]] virtual std::string last_error() const { return {}; }
  /// Message about a setting that was not applied as requested; empty if there is none. Same rules
  /// as last_error().
  [[nodiscard]] virtual std::string remark() const { return {}; }
  [[nodiscard]] virtual InsStatistics statistics() const noexcept = 0;
};

/// Driver for one kind of INS: a row in the table of drivers. Same contract as CameraDriver.
class InsDriver {
 public:
  virtual ~InsDriver() = default;
  [[nodiscard]] virtual std::vector<DeviceInfo> enumerate() = 0;
  [[nodiscard]] virtual std::unique_ptr<InsDevice> open(std::string_view serial,
                                                        DeviceStatus* status) = 0;
  /// Message about the last open() that failed; empty if the status is sufficient.
  [[nodiscard]] virtual std::string last_error() const { return {}; }
};

}  // namespace vergence
