#pragma once
#include "drivers/device.hpp"

namespace vergence {

/// Thrown where a device or its driver refuses one of several steps; the message is kept
/// elsewhere. Off the real-time path.
struct Refused {
  DeviceStatus status = DeviceStatus::failed;
};

/// Takes the steps up to the first that is Refused. → ok, or its status
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
