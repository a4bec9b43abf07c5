#include "app/devices/comparison_settings.hpp"

#include <algorithm>
#include <array>
#include <numbers>
#include <string>

#include "app/runtime/errors.hpp"

namespace vergence::app {
namespace {

Vec3 vec3(const std::array<double, 3>& v) { return {v[0], v[1], v[2]}; }

}  // namespace

ComparisonOptions comparison_options(const Configuration& c) {
  ComparisonOptions o;
  o.T_ins_left =
      mount_of(vec3(c.ins.lever_arm_m), vec3(c.ins.boresight_deg) * (std::numbers::pi / 180));
  o.placement_m = c.comparison.placement_m;
  o.correlation_s = c.comparison.correlation_s;
  o.heading_sigma_rad = c.comparison.heading_sigma_deg * (std::numbers::pi / 180);
  o.max_gap = Duration::seconds(c.comparison.max_gap_ms * 1e-3);
  o.max_wait = Duration::seconds(c.comparison.max_wait_ms * 1e-3);
  if (c.ins.driver == "nmea" || c.ins.driver == "ubx") {  // readings 0.1 to 1 s apart
    o.max_gap = std::max(o.max_gap, Duration::seconds(1.5 / c.ins.rate));
    o.max_wait = std::max(o.max_wait, Duration::seconds(0.5 + 1.5 / c.ins.rate));
  }
  o.jump_m = c.comparison.jump_m;
  o.scale_tolerance = c.comparison.scale_tolerance;
  if (const char* sentence = o.validate()) throw InputError(std::string("comparison: ") + sentence);
  return o;
}

}  // namespace vergence::app
