#include "app/devices/exposure_settings.hpp"

#include <fmt/format.h>

#include "app/runtime/errors.hpp"

namespace vergence::app {
namespace {

Duration microseconds(double us) { return Duration::seconds(us * 1e-6); }

}  // namespace

bool exposes_by_itself(const Configuration& c) { return c.exposure.mode != 0; }

exposure::ExposureOptions exposure_options(const Configuration& c) {
  exposure::ExposureOptions o;
  o.target = c.exposure.target;
  o.may_saturate = 0.01 * c.exposure.saturated_percent;
  o.least = microseconds(c.exposure.min_us);
  o.most = microseconds(c.exposure.max_us);
  o.most_gain_db = c.exposure.max_gain_db;
  o.settle_frames = c.exposure.settle_frames;
  if (const char* sentence = o.validate()) throw InputError(std::string("exposure: ") + sentence);
  if (c.exposure.max_us * 1e-6 * c.trigger.rate > 1)
    throw InputError(fmt::format(
        "exposure.max_us is {}, longer than the {:.0f} µs between two pulses (trigger.rate {})",
        c.exposure.max_us, 1e6 / c.trigger.rate, c.trigger.rate));
  return o;
}

ExposureSetting starting_exposure(const Configuration& c, std::size_t k) {
  const CameraSettings& camera = c.cameras[exposes_by_itself(c) ? 0 : k];
  const ExposureSetting own{microseconds(camera.exposure_us), camera.gain_db};
  return exposes_by_itself(c) ? exposure::within(exposure_options(c), own) : own;
}

}  // namespace vergence::app
