#pragma once
#include <array>
#include <cstdint>
#include <string>

#include "core/types/calibration.hpp"
#include "core/types/time.hpp"
#include "drivers/device.hpp"

/// What a recording holds of the devices of a drive, beside their frames and pulses: enough to go
/// through drivers, clocks and synchroniser again. Plain values; stamps are on the session's clock.
namespace vergence::app {

/// Devices that may be on a serial line.
enum class DeviceLine : std::uint8_t { ins, board };

/// Which frames of the cameras a set was made of: theirs that arrived then. Stamp{}: none.
struct SetArrivals {
  std::uint64_t number = 0;  // of the set
  std::array<Stamp, kMaxCameras> at{};
};

/// Who a device was, and what its driver knew of its delays.
struct RecordedDevice {
  DeviceInfo info{};
  DeviceTiming timing{};
};

}  // namespace vergence::app
