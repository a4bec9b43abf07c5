#include "drivers/device.hpp"

#include <cmath>
#include <string>

#include "drivers/camera.hpp"
#include "drivers/common/format_text.hpp"

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

std::string find_invalid(const CameraConfiguration& requested) {
  const auto number = [](double value) { return format_text("%.6g", value); };
  if (requested.width <= 0 || requested.height <= 0)
    return "a size of " + std::to_string(requested.width) + " x " +
           std::to_string(requested.height);
  if (!(requested.rate_hz > 0) || requested.rate_hz > 1e6)
    return "a rate of " + number(requested.rate_hz) + " Hz";
  if (requested.exposure <= Duration{}) return "an exposure that is not positive";
  if (requested.exposure.to_seconds() * requested.rate_hz > 1)
    return "an exposure of " + number(requested.exposure.to_seconds() * 1e6) +
           " us, longer than the time between two images";
  if (requested.offset_x < 0 || requested.offset_y < 0)
    return "a region that begins outside the sensor";
  if (!std::isfinite(requested.gain_db)) return "a gain that is no number";
  return {};
}

}  // namespace vergence
