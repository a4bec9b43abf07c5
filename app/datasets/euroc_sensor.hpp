#pragma once
#include <filesystem>

#include <yaml-cpp/yaml.h>

#include "core/math/se3.hpp"

namespace vergence::app {

/// A YAML file as EuRoC and OpenCV write it: a first line `%YAML:1.0`, which is not YAML, is passed
/// over. InputError with file:line: not there, not YAML, not a map at its root.
[[nodiscard]] YAML::Node read_sensor_yaml(const std::filesystem::path& file);

/// T_BS of a sensor.yaml: p_body = T_body_sensor * p_sensor, metres. Rotation normalised when off
/// by up to 1e-4, else refused.
[[nodiscard]] Transform read_sensor_mount(const std::filesystem::path& file);

/// A rotation as a file gives it. False: off orthonormal by more than 1e-4 in an element of R Rᵀ −
/// I, or a reflection; *R as it was.
[[nodiscard]] bool accept_rotation(const Mat3& written, Mat3* R) noexcept;

}  // namespace vergence::app
