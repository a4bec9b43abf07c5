#pragma once

#include <map>
#include <optional>

#include "app/config/yaml_file.hpp"
#include "core/types/calibration.hpp"

namespace vergence::app {

/// Content of a session's calibration.yaml: the rig's parameters, names and serial numbers.
struct CalibrationFile {
  RigCalibration rig{};
  std::string rig_name{};
  std::array<std::string, kMaxCameras> names{"left", "right", "camera2", "camera3"};
  /// Empty if unknown.
  std::array<std::string, kMaxCameras> serials{};
  /// Origin of the calibration: `given`, `online`, `checkerboard`; empty if unknown.
  std::string source{};
  /// Configured values of the rig when the calibration was found, by key (calibration_state.hpp).
  /// Stored in the state file.
  std::optional<std::map<std::string, std::string>> configured{};
};

/// Parts of a calibration to read.
struct CalibrationUse {
  /// Reads only the intrinsics and the baseline's length, for a calibration from scratch;
  /// extrinsics are ignored and may be missing.
  bool length_only = false;
  /// Replaces the file's baseline, in m; 0 keeps the file's.
  double baseline = 0;
};

/// Throws InputError with file:line and the field's name for an unreadable file, an unknown key, a
/// missing or malformed field, or an implausible value.
[[nodiscard]] CalibrationFile read_calibration(const std::filesystem::path& path,
                                               const CalibrationUse& use = {});
/// `name` replaces the file in error messages.
[[nodiscard]] CalibrationFile parse_calibration(std::string_view yaml, const std::string& name,
                                                const CalibrationUse& use = {});

/// Applies the use to a calibration of another file. With a baseline all lengths are scaled by one
/// factor. With length_only the cameras become parallel, one baseline apart, and the data of the
/// extrinsics (sigmas, date) are removed; the intrinsics stay.
void apply_use(const CalibrationUse& use, RigCalibration* rig);

/// Makes the cameras parallel, each one baseline to the right of the previous: X_k = X − (k L, 0,
/// 0).
void make_parallel(RigCalibration* rig);

/// Writes atomically, see replace_durably(). Reading gives equal doubles. Throws InputError on
/// failure.
void write_calibration(const std::filesystem::path& path, const CalibrationFile& calibration);
/// Omits `configured`, which only the state file contains.
[[nodiscard]] std::string format_calibration(const CalibrationFile& calibration);

}  // namespace vergence::app
