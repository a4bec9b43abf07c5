#pragma once
#include "app/config/configuration.hpp"
#include "core/types/calibration.hpp"

/// The rig that a configuration describes. InputError names the key.
namespace vergence::app {

/// Cameras with a driver. InputError: a hole in the list.
[[nodiscard]] int camera_count(const Configuration& configuration);

/// The rig as it is mounted, which a mock renders: each camera's own `model`, `intrinsics`,
/// `distortion` and `T_camera_left`, or where it has none those of `rig.nominal`, parallel cameras
/// one baseline apart.
[[nodiscard]] RigCalibration mounted_rig(const Configuration& configuration);

/// What the estimator is given of it: the mounted rig, for a mock with the errors of
/// `mock.intrinsics_error` and `mock.calibration_error`. `baseline` is the length that somebody
/// measured.
[[nodiscard]] RigCalibration nominal_rig(const Configuration& configuration);

}  // namespace vergence::app
