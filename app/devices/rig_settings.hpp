#pragma once
#include <cstddef>

#include "app/config/configuration.hpp"
#include "core/comparison/comparison.hpp"
#include "core/types/calibration.hpp"
#include "drivers/camera.hpp"
#include "drivers/exposure/exposure_controller.hpp"

/// The rig that a configuration describes. InputError names the key.
namespace vergence::app {

/// Cameras with a driver. InputError: a hole in the list.
[[nodiscard]] int camera_count(const Configuration& configuration);

/// InputError: fewer than two cameras, or cameras of different image sizes.
void check_cameras(const Configuration& configuration);

/// The rig as it is mounted, which a mock renders: each camera's own `model`, `intrinsics`,
/// `distortion` and `T_camera_left`, or where it has none those of `rig.nominal`, parallel cameras
/// one baseline apart.
[[nodiscard]] RigCalibration mounted_rig(const Configuration& configuration);

/// Calibration of the rig for the estimator: the mounted rig, for a mock with the errors of
/// `mock.intrinsics_error` and `mock.calibration_error`. `baseline` is the length that was
/// measured.
[[nodiscard]] RigCalibration nominal_rig(const Configuration& configuration);

/// `comparison:`, and the INS's mount of `ins:`, as the comparison takes them. InputError: what
/// does not go together.
[[nodiscard]] ComparisonOptions comparison_options(const Configuration& configuration);

/// `exposure.mode: auto`.
[[nodiscard]] bool exposes_by_itself(const Configuration& configuration);

/// `exposure:` as the controller takes it. InputError names the keys that do not go together.
[[nodiscard]] exposure::ExposureOptions exposure_options(const Configuration& configuration);

/// Initial exposure of camera k: its own; where exposures are controlled camera 0's, inside the
/// bounds, for all alike.
[[nodiscard]] ExposureSetting starting_exposure(const Configuration& configuration, std::size_t k);

/// Returns the settings with which camera k is opened; `sharing` is left at its default.
[[nodiscard]] CameraConfiguration camera_configuration(const Configuration& configuration,
                                                       std::size_t k);

}  // namespace vergence::app
