#pragma once
#include <cstddef>

#include "app/config/configuration.hpp"
#include "core/comparison/comparison.hpp"
#include "core/types/calibration.hpp"
#include "drivers/exposure/exposure_controller.hpp"

/// Rig described by a configuration. Functions throw InputError with the key.
namespace vergence::app {

/// Number of cameras with a driver. Throws InputError for a gap in the list.
[[nodiscard]] int camera_count(const Configuration& configuration);

/// Throws InputError for fewer than two cameras, or different image sizes.
void check_cameras(const Configuration& configuration);

/// Calibration of the mounted rig, which a mock renders: each camera's `model`, `intrinsics`,
/// `distortion` and `T_camera_left`, or those of `rig.nominal`, with parallel cameras one baseline
/// apart.
[[nodiscard]] RigCalibration mounted_rig(const Configuration& configuration);

/// Calibration for the estimator: the mounted rig, with the errors of `mock.intrinsics_error` and
/// `mock.calibration_error` for a mock. `baseline` is the measured length.
[[nodiscard]] RigCalibration nominal_rig(const Configuration& configuration);

/// Options of the comparison from `comparison` and the INS extrinsics in `ins`. Throws InputError
/// for contradictions.
[[nodiscard]] ComparisonOptions comparison_options(const Configuration& configuration);

/// True for `exposure.mode: auto`.
[[nodiscard]] bool exposes_by_itself(const Configuration& configuration);

/// Options of the exposure controller. Throws InputError with the contradicting keys.
[[nodiscard]] exposure::ExposureOptions exposure_options(const Configuration& configuration);

/// Initial exposure of camera k: its own or, if exposures are controlled, camera 0's for all,
/// clamped to the bounds.
[[nodiscard]] ExposureSetting starting_exposure(const Configuration& configuration, std::size_t k);

/// Returns the settings with which camera k is opened; `sharing` is left at its default.
[[nodiscard]] CameraConfiguration camera_configuration(const Configuration& configuration,
                                                       std::size_t k);

/// Configuration for capturing images, which needs only the cameras and their trigger. The INS may
/// be absent, so it is removed unless its SyncOut makes the pulses.
[[nodiscard]] Configuration capture_configuration(const Configuration& configuration);

/// Names of the cameras for files and messages: those of the configuration (letters, digits, `_`
/// and `-`, everything else becomes `_`), or `camera0` …; each is unique.
[[nodiscard]] std::vector<std::string> camera_names(const Configuration& configuration,
                                                    int cameras);

}  // namespace vergence::app
