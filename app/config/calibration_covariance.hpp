#pragma once

#include "app/config/calibration_file.hpp"

/// Group `covariance` of calibration.yaml: the joint covariance of a rig's parameters. `parameters`
/// names the rows by camera and parameter (`right.rx`, `left.k1`), `upper` has the upper triangle
/// row by row. Names that two cameras share are numbered. Rotations in rad and translations in m
/// are left perturbations; intrinsics are in px or without unit.
namespace vergence::app {

/// Empty if no covariance is known.
[[nodiscard]] std::string format_covariance(const CalibrationFile& calibration);

/// Reads the group. Names, camera models and the number of cameras must be read before. Throws
/// InputError.
void read_covariance(const YamlFile& file, const YAML::Node& group, CalibrationFile* calibration);

/// Message fragment about an invalid covariance: a non-finite number, a negative variance, or not
/// positive semidefinite beyond the rounding to nine digits.
[[nodiscard]] std::optional<std::string> find_flaw(const RigCovariance& covariance);

/// Scales the rows and columns of translations by a factor.
void scale_lengths(double factor, RigCovariance* covariance);
/// Removes the covariance of the extrinsics and keeps that of the intrinsics.
void clear_places(RigCovariance* covariance);

}  // namespace vergence::app
