#pragma once
#include "drivers/device.hpp"

namespace vergence {

/// Thrown if a device or its driver refuses one of several steps. The message is stored elsewhere.
/// Not for the real-time path.
struct Refused {
  DeviceStatus status = DeviceStatus::failed;
};

/// Runs the steps up to the first that throws Refused. → ok, or its status
template <class Steps>
[[nodiscard]] DeviceStatus run_steps(const Steps& steps) {
  try {
    steps();
    return DeviceStatus::ok;
  } catch (const Refused& refused) {
    return refused.status;
  }
}

}  // namespace vergence
