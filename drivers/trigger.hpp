#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "core/types/calibration.hpp"
#include "drivers/device.hpp"

namespace vergence {

/// Exposure of one camera as measured on its feedback input, relative to the edge of its pulse. Not
/// `seen` means that the input is not wired or that no exposure happened.
struct PulseExposure {
  bool seen = false;
  Duration start{}, end{};
};

/// Pulse sent to the cameras.
struct Pulse {
  /// Increases by one per pulse, including pulses omitted by a pause; restarts at 0 with another
  /// `boot`.
  std::uint64_t number = 0;
  /// Time of the edge on the trigger board's clock.
  DeviceStamp edge{};
  /// Time when the report arrived.
  HostStamp arrival{};
  /// Identifies the start of the trigger board; numbers and edges of two boots are not comparable.
  std::uint32_t boot = 0;
  /// True for the first pulse after a start or a pause.
  bool resumed = false;
  /// Exposures by camera index.
  std::array<PulseExposure, kMaxCameras> exposure{};
  // True if the driver set `host` itself, because it queries the trigger board's time. Otherwise a
  // ClockMapper derives `host` from `arrival`.
  bool mapped = false;
  /// `edge` on the host's clock.
  HostStamp host{};
  /// Upper bound of |true − host|.
  Duration host_error{};
};

/// Requested or applied configuration of a trigger board.
struct TriggerConfiguration {
  double rate_hz = 0;
  /// Width of a pulse.
  Duration width = Duration::microseconds(200);
  /// If not 0, every interval is longer or shorter by this duration, in a sequence that does not
  /// repeat, so that the cameras' own stamps verify which frame belongs to which pulse.
  Duration vary{};
  /// Mask of the outputs that are pulsed; output k triggers camera k.
  std::uint8_t lines = 0x03;
  /// Mask of the outputs that are active low.
  std::uint8_t active_low = 0;
  /// Mask of the inputs wired to the cameras' exposure-active outputs.
  std::uint8_t feedback = 0;
  std::uint8_t feedback_active_low = 0;
};

/// Counters since open; all only grow.
struct TriggerStatistics {
  /// Reported pulses.
  std::uint64_t pulses = 0;
  /// Pulses whose report was not received.
  std::uint64_t lost = 0;
  /// Restarts of the trigger board.
  std::uint64_t reboots = 0;
  /// Reports that could not be decoded.
  std::uint64_t malformed = 0;
  /// Reports dropped because the ring was full.
  std::uint64_t overruns = 0;
  std::uint64_t starts = 0;
};

/// One opened trigger board. Cameras are armed (started) first, then the board.
///
///     if (board.configure({.rate_hz = 20, .lines = 0x03}, nullptr) != DeviceStatus::ok) return;
///     if (left.start(nullptr) != DeviceStatus::ok) return;  // armed before there are pulses
///     if (board.start(nullptr) != DeviceStatus::ok) return;
///     for (Pulse pulse; board.wait(Duration::seconds(1), &pulse) == DeviceStatus::ok;)
///       if (pulse.mapped) synchronizer.pulse(pulse);
///
/// Ownership, threads, memory and errors are those of InsDevice.
class TriggerDevice {
 public:
  /// Stops the pulses.
  virtual ~TriggerDevice() = default;

  [[nodiscard]] virtual const DeviceInfo& info() const noexcept = 0;
  /// → ok, unsupported, bad_configuration, disconnected
  [[nodiscard]] virtual DeviceStatus configure(const TriggerConfiguration& requested,
                                               TriggerConfiguration* actual) noexcept = 0;
  /// Delays from an edge to the arrival of its report. Precondition: configured.
  [[nodiscard]] virtual DeviceTiming timing() const noexcept { return {}; }
  /// Starts the pulses. Same contract as CameraDevice::start().
  [[nodiscard]] virtual DeviceStatus start(Notifier* ready) noexcept = 0;
  /// Returns the oldest report not yet read and waits at most `limit` for it (0: does not wait). →
  /// ok, timeout, stopped, ended, disconnected
  [[nodiscard]] virtual DeviceStatus wait(Duration limit, Pulse* pulse) noexcept = 0;
  /// Omits this number of pulses as soon as possible and then resumes: a gap that all cameras
  /// share. Does not wait for the trigger board; one thread may call it while streaming. → ok,
  /// unsupported, stopped, disconnected
  [[nodiscard]] virtual DeviceStatus pause(std::uint32_t /*pulses*/) noexcept {
    return DeviceStatus::unsupported;
  }
  /// Stops the pulses. No pulse is sent after it returns.
  virtual void stop() noexcept = 0;
  /// Same contract as those of InsDevice.
  [[nodiscard]] virtual std::string last_error() const { return {}; }
  [[nodiscard]] virtual std::string remark() const { return {}; }
  [[nodiscard]] virtual TriggerStatistics statistics() const noexcept = 0;
};

/// Driver for one kind of trigger board: a row in the table of drivers. Same contract as
/// CameraDriver.
class TriggerDriver {
 public:
  virtual ~TriggerDriver() = default;
  [[nodiscard]] virtual std::vector<DeviceInfo> enumerate() = 0;
  [[nodiscard]] virtual std::unique_ptr<TriggerDevice> open(std::string_view serial,
                                                            DeviceStatus* status) = 0;
  /// Same contract as InsDriver::last_error().
  [[nodiscard]] virtual std::string last_error() const { return {}; }
};

}  // namespace vergence
