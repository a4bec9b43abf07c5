#pragma once
#include <cstddef>

#include "app/config/configuration.hpp"
#include "drivers/camera.hpp"
#include "drivers/exposure/exposure_controller.hpp"

namespace vergence::app {

/// `exposure.mode: auto`.
[[nodiscard]] bool exposes_by_itself(const Configuration& configuration);

/// `exposure:` as the controller takes it. InputError names the keys that do not go together.
[[nodiscard]] exposure::ExposureOptions exposure_options(const Configuration& configuration);

/// What camera k begins with: its own; where exposures are controlled camera 0's, inside the
/// bounds, for all alike.
[[nodiscard]] ExposureSetting starting_exposure(const Configuration& configuration, std::size_t k);

}  // namespace vergence::app
