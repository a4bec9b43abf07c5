#include "app/doctor/checks.hpp"

#include <algorithm>
#include <array>
#include <iterator>

#include <fmt/format.h>

#include "app/devices/rig_settings.hpp"

namespace vergence::app {
namespace {

/// Bytes of a pixel on its way, by the name of its format; where the driver chooses, what it
/// chooses first.
double bytes_per_pixel(const CameraSettings& s) {
  const std::string& f = s.pixel_format;
  const auto has = [&f](const char* part) { return f.find(part) != std::string::npos; };
  if (f.empty())
    return s.driver == "v4l2" ? 2 : 1;  // YUYV is what cameras of the USB video class have
  if (has("10P") || has("10p")) return 1.25;
  if (has("422") || has("YU") || has("VY") || has("16") || has("14") || has("12") || has("10"))
    return 2;
  if (has("RGB8") || has("444")) return 3;
  return 1;
}

}  // namespace

const char* to_string(FindingState state) noexcept {
  constexpr std::array kNames{"ok", "advice", "problem"};
  return kNames.at(static_cast<std::size_t>(state));
}

std::vector<CameraNeed> Needs::of(const std::string& driver) const {
  std::vector<CameraNeed> some;
  std::copy_if(cameras.begin(), cameras.end(), std::back_inserter(some),
               [&](const CameraNeed& c) { return c.driver == driver; });
  return some;
}

Needs needs_of(const Configuration& c) {
  Needs needs;
  needs.given = true;
  needs.realtime_priority = c.realtime.priority;
  needs.lock_memory = c.realtime.lock_memory != 0;
  for (int k = 0; k < camera_count(c); ++k) {
    const CameraSettings& s = c.cameras[static_cast<std::size_t>(k)];
    CameraNeed n;
    n.key = fmt::format("cameras.{}", k);
    n.name = s.name;
    n.driver = s.driver;
    n.serial = s.serial;
    n.bytes = bytes_per_pixel(s) * s.width * s.height;
    needs.cameras.push_back(std::move(n));
  }
  needs.ins_driver = c.ins.driver;
  needs.ins_port = c.ins.port;
  needs.trigger_driver = c.trigger.driver;
  needs.trigger_port = c.trigger.port;
  return needs;
}

bool is_real_driver(const std::string& driver) {
  return !driver.empty() && driver != "none" && driver != "mock";
}

std::vector<Finding> run_checks(const CheckContext& context) {
  std::vector<Finding> findings;
  for (const auto check : {check_devices, check_network, check_system}) check(context, &findings);
  std::stable_sort(findings.begin(), findings.end(),
                   [](const Finding& a, const Finding& b) { return a.state > b.state; });
  return findings;
}

}  // namespace vergence::app
