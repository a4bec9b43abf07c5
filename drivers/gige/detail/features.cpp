#include "drivers/gige/detail/features.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

namespace vergence::gige {
namespace {

struct Names {
  Purpose purpose;
  std::array<const char*, 4> names;  // newest standard first; null: no more
};
constexpr std::array kNames{
    Names{Purpose::exposure, {"ExposureTime", "ExposureTimeAbs", "ExposureTimeRaw", "Exposure"}},
    Names{Purpose::gain, {"Gain", "GainAbs", "GainRaw", nullptr}},
    Names{Purpose::frame_rate,
          {"AcquisitionFrameRate", "AcquisitionFrameRateAbs", nullptr, nullptr}},
    Names{Purpose::trigger_delay, {"TriggerDelay", "TriggerDelayAbs", nullptr, nullptr}},
    Names{Purpose::serial, {"DeviceSerialNumber", "DeviceID", nullptr, nullptr}},
    Names{Purpose::ptp_enable, {"PtpEnable", "GevIEEE1588", nullptr, nullptr}},
    Names{Purpose::ptp_status, {"PtpStatus", "GevIEEE1588Status", nullptr, nullptr}},
    Names{Purpose::ptp_latch, {"PtpDataSetLatch", "GevIEEE1588DataSetLatch", nullptr, nullptr}},
    Names{Purpose::chunk_mode, {"ChunkModeActive", "ChunkMode", nullptr, nullptr}},
    Names{Purpose::temperature, {"DeviceTemperature", "DeviceTemperatureAbs"}},
    Names{Purpose::chunk_exposure,
          {"ChunkExposureTime", "ChunkExposureTimeAbs", "ChunkExposure", nullptr}},
};

std::string shown(double v) {
  std::array<char, 32> text{};
  (void)std::snprintf(text.data(), text.size(), "%.6g", v);
  return text.data();
}

std::string listed(const std::vector<std::string>& words) {
  std::string all;
  for (const std::string& w : words) all += (all.empty() ? "" : ", ") + w;
  return all.empty() ? "nothing" : all;
}

}  // namespace

bool Features::has(const std::string& name) const {
  Error error;
  return arv_device_is_feature_available(device_, name.c_str(), error.out()) != 0 && !error;
}

const char* Features::find(Purpose purpose) const {
  for (const Names& row : kNames) {
    if (row.purpose != purpose) continue;
    for (const char* name : row.names)
      if (name != nullptr && has(name)) return name;
  }
  return nullptr;
}

std::optional<Features::Bounds> Features::bounds(const std::string& name) const {
  ArvGcNode* node = arv_device_get_feature(device_, name.c_str());
  Error error;
  Bounds b;
  if (ARV_IS_GC_FLOAT(node)) {
    arv_device_get_float_feature_bounds(device_, name.c_str(), &b.least, &b.most, error.out());
  } else if (ARV_IS_GC_INTEGER(node)) {
    gint64 least = 0, most = 0;
    arv_device_get_integer_feature_bounds(device_, name.c_str(), &least, &most, error.out());
    if (error) return std::nullopt;
    b.least = static_cast<double>(least);
    b.most = static_cast<double>(most);
    b.step = static_cast<double>(
        arv_device_get_integer_feature_increment(device_, name.c_str(), error.out()));
    if (error || !(b.step >= 1)) b.step = 1;
    return b;
  } else {
    return std::nullopt;
  }
  if (error) return std::nullopt;
  return b;
}

std::optional<double> Features::number(const std::string& name) const {
  ArvGcNode* node = arv_device_get_feature(device_, name.c_str());
  Error error;
  double value = 0;
  if (ARV_IS_GC_FLOAT(node))
    value = arv_device_get_float_feature_value(device_, name.c_str(), error.out());
  else if (ARV_IS_GC_INTEGER(node))
    value = static_cast<double>(
        arv_device_get_integer_feature_value(device_, name.c_str(), error.out()));
  else
    return std::nullopt;
  if (error) return std::nullopt;
  return value;
}

std::string Features::text(const std::string& name) const {
  Error error;
  const char* value = arv_device_get_string_feature_value(device_, name.c_str(), error.out());
  return value == nullptr || error ? "" : value;
}

std::vector<std::string> Features::choices(const std::string& name) const {
  Error error;
  guint n = 0;
  const Memory<const char*> entries(arv_device_dup_available_enumeration_feature_values_as_strings(
      device_, name.c_str(), &n, error.out()));
  std::vector<std::string> all;
  for (guint i = 0; entries != nullptr && i < n; ++i) all.emplace_back(entries.get()[i]);
  return all;
}

bool Features::set(const std::string& name, double value, const char* unit, double* actual) {
  const auto limits = bounds(name);
  if (!limits) return refuse("the camera has no number " + name);
  const bool whole = limits->step > 0;
  if (whole)
    value = limits->least + std::round((value - limits->least) / limits->step) * limits->step;
  const double slack =
      1e-6 * std::max(1.0, std::abs(value));  // floats on their way through a register of 32 bits
  if (value < limits->least - slack || value > limits->most + slack)
    return refuse(name + " " + shown(value) + " " + unit + " is not possible: the camera offers " +
                  shown(limits->least) + " to " + shown(limits->most) + " " + unit);
  Error error;
  if (whole)
    arv_device_set_integer_feature_value(device_, name.c_str(),
                                         static_cast<gint64>(std::llround(value)), error.out());
  else
    arv_device_set_float_feature_value(device_, name.c_str(), value, error.out());
  if (error)
    return refuse(name + " " + shown(value) + " " + unit + " was refused: " + error.text());
  if (actual != nullptr) *actual = number(name).value_or(value);
  return true;
}

bool Features::choose(const std::string& name, const std::string& entry) {
  if (!has(name)) return refuse("the camera has no " + name);
  const auto all = choices(name);
  if (std::find(all.begin(), all.end(), entry) == all.end())
    return refuse(name + " has no " + entry + "; the camera offers " + listed(all));
  Error error;
  arv_device_set_string_feature_value(device_, name.c_str(), entry.c_str(), error.out());
  return !error || refuse(name + " " + entry + " was refused: " + error.text());
}

bool Features::switch_on(const std::string& name, bool on) {
  if (!has(name)) return refuse("the camera has no " + name);
  if (ARV_IS_GC_ENUMERATION(arv_device_get_feature(device_, name.c_str())))
    return choose(name, on ? "On" : "Off");
  Error error;
  arv_device_set_boolean_feature_value(device_, name.c_str(), on ? TRUE : FALSE, error.out());
  return !error || refuse(name + " was refused: " + error.text());
}

bool Features::execute(const std::string& name) {
  if (!has(name)) return refuse("the camera has no " + name);
  Error error;
  arv_device_execute_command(device_, name.c_str(), error.out());
  return !error || refuse(name + " was refused: " + error.text());
}

bool Features::set_text(const std::string& name, const std::string& value) {
  ArvGcNode* node = arv_device_get_feature(device_, name.c_str());
  if (node == nullptr || !has(name)) return refuse("the camera has no feature " + name);
  if (ARV_IS_GC_COMMAND(node)) return execute(name);
  if (ARV_IS_GC_ENUMERATION(node)) return choose(name, value);
  if (ARV_IS_GC_BOOLEAN(node))
    return switch_on(name, value == "on" || value == "true" || value == "1");
  if (ARV_IS_GC_FLOAT(node) || ARV_IS_GC_INTEGER(node)) {
    char* end = nullptr;
    const double v = g_ascii_strtod(value.c_str(), &end);
    if (value.empty() || *end != '\0')
      return refuse(name + " is a number; \"" + value + "\" is none");
    return set(name, v, "", nullptr);
  }
  Error error;
  arv_device_set_string_feature_value(device_, name.c_str(), value.c_str(), error.out());
  return !error || refuse(name + " was refused: " + error.text());
}

void Features::choose_if_there(const std::string& name, const std::string& entry) {
  if (!has(name)) return;
  const auto all = choices(name);
  if (std::find(all.begin(), all.end(), entry) == all.end()) return;
  Error error;
  arv_device_set_string_feature_value(device_, name.c_str(), entry.c_str(), error.out());
}

}  // namespace vergence::gige
