#pragma once
#include <cstdint>
#include <memory>
#include <string_view>
#include <vector>

#include "drivers/device.hpp"

namespace vergence {

/// One pulse that went out to the cameras.
struct Pulse {
  std::uint64_t number = 0;  // since start(), the first is 0
  DeviceStamp edge{};        // by the board's clock
  HostStamp arrival{};       // when its report was here
};

struct TriggerConfiguration {
  double rate_hz = 0;
};

/// Counters since open; all only grow.
struct TriggerStatistics {
  std::uint64_t pulses = 0;     // reported
  std::uint64_t malformed = 0;  // reports that made no sense
  std::uint64_t overruns = 0;   // reports that found the ring full
  std::uint64_t starts = 0;
};

/// One opened trigger board. Cameras are armed (started) first, then the board: so every camera's exposure 0 is pulse 0.
///
/// Ownership, threads, memory, errors: as InsDevice.
class TriggerDevice {
 public:
  virtual ~TriggerDevice() = default;  // stops

  [[nodiscard]] virtual const DeviceInfo& info() const noexcept = 0;
  /// → ok, unsupported, bad_configuration, gone
  [[nodiscard]] virtual DeviceStatus configure(const TriggerConfiguration& wanted, TriggerConfiguration* actual) noexcept = 0;
  /// The first pulse goes out after this. As CameraDevice::start().
  [[nodiscard]] virtual DeviceStatus start(Notifier* ready) noexcept = 0;
  /// Oldest report not yet taken, waiting at most `limit` (0: look once). → ok, timeout, stopped, ended, gone
  [[nodiscard]] virtual DeviceStatus wait(Duration limit, Pulse* pulse) noexcept = 0;
  /// No pulse after it returns.
  virtual void stop() noexcept = 0;
  [[nodiscard]] virtual TriggerStatistics statistics() const noexcept = 0;
};

/// One kind of trigger board: a row in the table of drivers. As CameraDriver.
class TriggerDriver {
 public:
  virtual ~TriggerDriver() = default;
  [[nodiscard]] virtual std::vector<DeviceInfo> enumerate() = 0;
  [[nodiscard]] virtual std::unique_ptr<TriggerDevice> open(std::string_view serial, DeviceStatus* status) = 0;
};

}  // namespace vergence
