#pragma once
#include <filesystem>

#include "core/math/se3.hpp"
#include "core/types/calibration.hpp"

/// EuRoC's sensor.yaml. InputError with file:line: not there, not YAML, a key that is missing or no
/// such value.
namespace vergence::app {

/// T_BS of a sensor.yaml: p_body = T_body_sensor * p_sensor, metres. Rotation normalised when off
/// by up to 1e-4, else refused.
[[nodiscard]] Transform read_sensor_mount(const std::filesystem::path& file);

/// The rig of two cameras' files, left first.
[[nodiscard]] RigCalibration read_sensor_rig(const std::filesystem::path& left,
                                             const std::filesystem::path& right);

/// A rotation as a file gives it. False: off orthonormal by more than 1e-4 in an element of R Rᵀ −
/// I, or a reflection; *R as it was.
[[nodiscard]] bool accept_rotation(const Mat3& written, Mat3* R) noexcept;

}  // namespace vergence::app
