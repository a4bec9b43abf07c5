#include "drivers/v4l2/request_checks.hpp"

#include <array>
#include <cmath>
#include <cstdio>

namespace vergence::v4l2 {
std::string number_text(double value) {
  std::array<char, 32> text{};
  (void)std::snprintf(text.data(), text.size(), "%.6g", value);
  return text.data();
}

std::string find_invalid(const CameraConfiguration& requested) {
  if (requested.width <= 0 || requested.height <= 0)
    return "a size of " + std::to_string(requested.width) + " x " +
           std::to_string(requested.height);
  if (!(requested.rate_hz > 0) || requested.rate_hz > 1e6)
    return "a rate of " + number_text(requested.rate_hz) + " Hz";
  if (requested.exposure <= Duration{}) return "an exposure that is not positive";
  if (requested.exposure.to_seconds() * requested.rate_hz > 1)
    return "an exposure longer than the time between two images";
  if (requested.offset_x < 0 || requested.offset_y < 0)
    return "a region that begins outside the sensor";
  if (!std::isfinite(requested.gain_db)) return "a gain that is no number";
  return {};
}

}  // namespace vergence::v4l2
