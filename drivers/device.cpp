#include "drivers/device.hpp"

#include <array>
#include <cmath>
#include <string>

#include "core/types/names.hpp"
#include "drivers/camera.hpp"
#include "drivers/format_text.hpp"

namespace vergence {

std::string_view to_string(DeviceStatus status) noexcept {
  return name_of(status, std::array{"ok", "timeout", "stopped", "ended", "disconnected",
                                    "not found", "no permission", "busy", "unsupported",
                                    "bad configuration", "no bandwidth", "failed"});
}

const char* to_string(CameraTrigger trigger) noexcept {
  return name_of(trigger, std::array{"hardware", "software", "free"});
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
  if (!std::isfinite(requested.gain_db)) return "a gain that is not a number";
  return {};
}

}  // namespace vergence
