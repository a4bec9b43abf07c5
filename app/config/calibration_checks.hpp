#pragma once
#include <optional>
#include <string>

#include "core/types/calibration.hpp"

namespace vergence::app {

/// Error in a calibration: the field as named in calibration.yaml (`cameras.1.T_camera_left`) and a
/// message fragment that begins with it.
struct ValidationError {
  std::string field;
  std::string message;
};

/// Checks whether a rig is plausible: sizes, focal lengths, principal points, distortion,
/// rotations, baseline, side of camera 1, covariances, finite numbers. Returns the first problem;
/// lengths in messages are in m and px. Not thread-safe for the same rig, because it repairs it.
///
/// For calibrations from other files (data sets): `if (auto bad = find_implausible(&rig)) throw
/// InputError(file + ": " + bad->message);` A rotation with an error of 1e-6 to 1e-3 (largest
/// element of RᵀR − I) is replaced by the nearest valid one; a larger error is reported.
[[nodiscard]] std::optional<ValidationError> find_implausible(RigCalibration* rig);

/// Message fragment about an invalid covariance: a non-finite number, a negative variance, or not
/// positive semidefinite beyond the rounding to nine digits.
[[nodiscard]] std::optional<std::string> find_flaw(const RigCovariance& covariance);

/// Text such as "the baseline is 0.1101 m", for a check by the user.
[[nodiscard]] std::string baseline_message(const RigCalibration& rig);
/// Question about the unit of an unusual length, above 2 m or below 2 cm; empty otherwise.
[[nodiscard]] std::string baseline_warning(const RigCalibration& rig);

}  // namespace vergence::app
