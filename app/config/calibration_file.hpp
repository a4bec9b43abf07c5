#pragma once
#include <yaml-cpp/node/node.h>

#include <array>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "app/config/yaml_file.hpp"
#include "core/types/calibration.hpp"

namespace vergence::app {

/// calibration.yaml (DESIGN §6): the rig's numbers and the words around them.
struct CalibrationFile {
  RigCalibration rig{};
  std::string rig_name{};
  std::array<std::string, kMaxCameras> names{"left", "right", "camera2", "camera3"};
  std::array<std::string, kMaxCameras> serials{};  // empty: not known
  std::string source{};  // what found it: `given`, `online`, `checkerboard`; empty: not said
  /// The configuration's values about the rig when the calibration was found, by key
  /// (calibration_state.hpp); kept in the state file.
  std::optional<std::map<std::string, std::string>> configured{};
};

/// Selects the parts of a calibration to read.
struct CalibrationUse {
  bool length_only = false;  // from scratch: intrinsics and the baseline's length; where the
                             // cameras sit is not read, nor has to be there
  double baseline = 0;       // m: instead of the file's; 0: the file's
};

/// Error in a calibration: the field as named in calibration.yaml
/// (`cameras.1.T_camera_left`) and half a message that begins with it.
struct ValidationError {
  std::string field;
  std::string message;
};

/// Looks whether a rig can be real: sizes, focal lengths, principal points, distortion, rotations,
/// baseline, side of camera 1, covariances, finite numbers. The first thing found; nothing when all
/// is well.
///
/// For calibrations from other files (data sets): `if (auto bad = find_implausible(rig)) throw
/// InputError(file + ": " + bad->message);` A rotation off by 1e-6 to 1e-3 (largest entry of RᵀR −
/// I) is replaced by the nearest one; beyond, it is reported.
[[nodiscard]] std::optional<ValidationError> find_implausible(RigCalibration* rig);

/// "the baseline is 0.1101 m", for people who know their rig.
[[nodiscard]] std::string baseline_message(const RigCalibration& rig);
/// Asks for the unit of a length above 2 m or below 2 cm, which few rigs have; empty: it is usual.
[[nodiscard]] std::string baseline_warning(const RigCalibration& rig);

/// Errors  InputError with file:line and the field's name: unreadable, unknown key, missing or
///         malformed field, implausible.
[[nodiscard]] CalibrationFile read_calibration(const std::filesystem::path& path,
                                               const CalibrationUse& use = {});
/// `name` stands for the file in error messages.
[[nodiscard]] CalibrationFile parse_calibration(std::string_view yaml, const std::string& name,
                                                const CalibrationUse& use = {});

/// Applies the use to a calibration of another file. With a baseline all lengths are scaled by one
/// factor; with length_only the cameras become parallel, one baseline apart, and what belonged to
/// their places (sigmas, when it was found) is gone; what is known of the lenses stays.
void apply_use(const CalibrationUse& use, RigCalibration* rig);

/// Cameras that look the same way, each a baseline to the right of the one before: X_k = X − (k L,
/// 0, 0).
void make_parallel(RigCalibration* rig);

/// read(write(c)) has the same doubles. Whole or not at all, see replace_durably(). Errors
/// InputError when it cannot be written.
void write_calibration(const std::filesystem::path& path, const CalibrationFile& calibration);
/// Without what the configuration said, which is the state file's.
[[nodiscard]] std::string format_calibration(const CalibrationFile& calibration);

}  // namespace vergence::app
