#include "drivers/device.hpp"

#include "drivers/camera.hpp"

namespace vergence {

std::string_view to_string(DeviceStatus status) noexcept {
  switch (status) {
    case DeviceStatus::ok:
      return "ok";
    case DeviceStatus::timeout:
      return "timeout";
    case DeviceStatus::stopped:
      return "stopped";
    case DeviceStatus::ended:
      return "ended";
    case DeviceStatus::gone:
      return "gone";
    case DeviceStatus::not_found:
      return "not found";
    case DeviceStatus::no_permission:
      return "no permission";
    case DeviceStatus::busy:
      return "busy";
    case DeviceStatus::unsupported:
      return "unsupported";
    case DeviceStatus::bad_configuration:
      return "bad configuration";
    case DeviceStatus::no_bandwidth:
      return "no bandwidth";
    case DeviceStatus::failed:
      return "failed";
  }
  return "";
}

const char* to_string(CameraTrigger trigger) noexcept {
  switch (trigger) {
    case CameraTrigger::hardware:
      return "hardware";
    case CameraTrigger::software:
      return "software";
    case CameraTrigger::free:
      return "free";
  }
  return "";
}

}  // namespace vergence
