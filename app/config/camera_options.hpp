#pragma once
#include <string>

#include "app/config/configuration.hpp"

/// `cameras.N.options` of a configuration: text to the typed options of the camera's driver, by the
/// table of drivers/options. Cameras of a driver without options (a mock's) keep none.
namespace vergence::app {

/// One option. Empty: done, or the driver has no options; else half a sentence about what is wrong.
[[nodiscard]] std::string set_camera_option(const std::string& name, const std::string& value,
                                            CameraSettings* camera);

/// All of them, `NAME=VALUE …`: those not named are as they begin. As set_camera_option().
[[nodiscard]] std::string set_camera_options(const std::string& text, CameraSettings* camera);

}  // namespace vergence::app
