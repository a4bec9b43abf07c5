#include "drivers/v4l2/options.hpp"

#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <string_view>

#include "drivers/v4l2/controls.hpp"

namespace vergence::v4l2 {
namespace {

constexpr std::string_view kControlPrefix = "control_";
constexpr int kLeastBuffers = 4, kMostBuffers = 32;  // 32: the kernel's own limit
constexpr int kMostThin = 60;

bool parse_number(const std::string& text, double* value) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), *value);
  return error == std::errc{} && end == text.data() + text.size() && std::isfinite(*value);
}

}  // namespace

std::string number_text(double value) {
  std::array<char, 32> text{};
  (void)std::snprintf(text.data(), text.size(), "%.6g", value);
  return text.data();
}

std::string find_nonsense(const CameraConfiguration& requested) {
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

bool parse_options(const CameraConfiguration& requested, Options* options, std::string* message) {
  Options o;
  const auto bad = [&](const std::string& key, const std::string& what) {
    *message = "option " + key + " is \"" + requested.options.at(key) + "\"; it wants " + what;
    return false;
  };
  for (const auto& [key, text] : requested.options) {
    double value = 0;
    const bool is_number = parse_number(text, &value);
    const auto whole = [&](double least, double most) {
      return is_number && value >= least && value <= most && value == std::floor(value);
    };
    if (key == "readout_us") {
      if (!is_number || value < 0 || value > 1e6) return bad(key, "microseconds, 0 to 1000000");
      o.readout = Duration::seconds(value * 1e-6);
    } else if (key == "shift") {
      if (!whole(0, 8)) return bad(key, "bits, 0 to 8");
      o.shift = static_cast<int>(value);
    } else if (key == "thin") {
      if (!whole(1, kMostThin))
        return bad(key, "how many times the rate the camera is to run at, 1 to 60");
      o.thin = static_cast<int>(value);
    } else if (key == "buffers") {
      if (!whole(kLeastBuffers, kMostBuffers)) return bad(key, "a number, 4 to 32");
      o.buffers = static_cast<int>(value);
    } else if (key == "gain_step_db") {
      if (!is_number || value <= 0 || value > 20)
        return bad(key, "dB a step, more than 0 and at most 20");
      o.gain_step_db = value;
    } else if (key == "subdevice") {
      o.subdevice = text;
    } else if (key == "trigger_control") {
      o.trigger_control = key_of(text);
    } else if (key == "trigger_value") {
      o.trigger_value = text;
    } else if (key.starts_with(kControlPrefix)) {
      o.controls.emplace_back(key_of(key.substr(kControlPrefix.size())), text);
    } else {
      *message = "there is no option " + key +
                 "; V4L2 cameras have readout_us, shift, thin, buffers, subdevice, "
                 "trigger_control, trigger_value, gain_step_db and "
                 "control_NAME for each of their controls";
      return false;
    }
  }
  *options = std::move(o);
  return true;
}

}  // namespace vergence::v4l2
