#pragma once
#include <optional>
#include <string>

#include "app/config/calibration_file.hpp"
#include "app/config/yaml_file.hpp"

/// The group `covariance` of calibration.yaml: what of a rig's parameters trades against what.
/// `parameters` names the rows by camera and number (`right.rx`, `left.k1`), `upper` has the upper
/// triangle row by row. Cameras go by their names, or by their index where names do not say them
/// apart. Rotation in rad, translation in m, as left perturbations; lenses in px and without unit.
namespace vergence::app {

/// Empty: nothing is known.
[[nodiscard]] std::string format_covariance(const CalibrationFile& calibration);

/// Names, lens models and the number of cameras are read already. Errors  InputError.
void read_covariance(const YamlFile& file, const YAML::Node& group, CalibrationFile* calibration);

/// Half a message about why this cannot be a covariance: a number that is not finite, a negative
/// variance, or not positive semidefinite beyond what nine digits leave.
[[nodiscard]] std::optional<std::string> find_flaw(const RigCovariance& covariance);

/// Lengths grow by a factor: rows and columns of translations do.
void scale_lengths(double factor, RigCovariance* covariance);
/// Removes the extrinsics' covariance and keeps that of the intrinsics.
void clear_places(RigCovariance* covariance);

}  // namespace vergence::app
