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

/// One camera's exposure as its feedback line told it, after the edge of its pulse. Not seen: not
/// wired, or no exposure happened.
struct PulseExposure {
  bool seen = false;
  Duration start{}, end{};
};

/// One pulse that went out to the cameras.
struct Pulse {
  /// Increases by one per pulse, also for pulses omitted by a pause; restarts at 0 with another
  /// `boot`.
  std::uint64_t number = 0;
  /// Time of the edge by the board's clock.
  DeviceStamp edge{};
  /// Time when the report arrived.
  HostStamp arrival{};
  /// Identifies the board's start; numbers and edges of two boots cannot be compared.
  std::uint32_t boot = 0;
  /// True for the first pulse after a start or a pause.
  bool resumed = false;
  /// Exposures by camera.
  std::array<PulseExposure, kMaxCameras> exposure{};
  // A driver that asks the board for its time maps the edge itself; else a ClockMapper does, from
  // `arrival`.
  bool mapped = false;
  /// `edge` on the host's clock.
  HostStamp host{};
  /// Upper bound of |true − host|.
  Duration host_error{};
};

/// Requested or applied configuration of a board.
struct TriggerConfiguration {
  double rate_hz = 0;
  /// Width of a pulse.
  Duration width = Duration::microseconds(200);
  /// 0: even intervals. Else every interval is longer or shorter by this, in an order that does not
  /// repeat, so that the cameras' own stamps prove which frame belongs to which pulse.
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
  /// Pulses whose report never came.
  std::uint64_t lost = 0;
  /// Restarts of the board.
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
/// Ownership, threads, memory, errors: as InsDevice.
class TriggerDevice {
 public:
  virtual ~TriggerDevice() = default;  // stops

  [[nodiscard]] virtual const DeviceInfo& info() const noexcept = 0;
  /// → ok, unsupported, bad_configuration, disconnected
  [[nodiscard]] virtual DeviceStatus configure(const TriggerConfiguration& requested,
                                               TriggerConfiguration* actual) noexcept = 0;
  /// From the edge to the arrival of its report. Precondition: configured.
  [[nodiscard]] virtual DeviceTiming timing() const noexcept { return {}; }
  /// The first pulse goes out after this. As CameraDevice::start().
  [[nodiscard]] virtual DeviceStatus start(Notifier* ready) noexcept = 0;
  /// Oldest report not yet taken, waiting at most `limit` (0: look once). → ok, timeout, stopped,
  /// ended, disconnected
  [[nodiscard]] virtual DeviceStatus wait(Duration limit, Pulse* pulse) noexcept = 0;
  /// Leaves so many pulses out, as soon as it can, then goes on by itself: a gap that every camera
  /// shows. While streaming; does not wait for the board. Any one thread. → ok, unsupported,
  /// stopped, disconnected
  [[nodiscard]] virtual DeviceStatus pause(std::uint32_t /*pulses*/) noexcept {
    return DeviceStatus::unsupported;
  }
  /// No pulse after it returns.
  virtual void stop() noexcept = 0;
  /// As those of InsDevice.
  [[nodiscard]] virtual std::string last_error() const { return {}; }
  [[nodiscard]] virtual std::string remark() const { return {}; }
  [[nodiscard]] virtual TriggerStatistics statistics() const noexcept = 0;
};

/// One kind of trigger board: a row in the table of drivers. As CameraDriver.
class TriggerDriver {
 public:
  virtual ~TriggerDriver() = default;
  [[nodiscard]] virtual std::vector<DeviceInfo> enumerate() = 0;
  [[nodiscard]] virtual std::unique_ptr<TriggerDevice> open(std::string_view serial,
                                                            DeviceStatus* status) = 0;
  /// As InsDriver::last_error().
  [[nodiscard]] virtual std::string last_error() const { return {}; }
};

}  // namespace vergence
