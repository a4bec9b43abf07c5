#pragma once

#include "app/config/calibration_file.hpp"
#include "app/config/configuration.hpp"

/// State file: the last calibration that a run accepted or verified, used as the start of the next
/// run.
namespace vergence::app {

/// Path of the rig's state file: `calibration_state.yaml` in `rig.state_dir`, or in
/// $XDG_STATE_HOME/vergence/NAME, or in ~/.local/state/vergence/NAME. Empty if `rig.state_dir` is
/// `none` or the user has no home. Unsuitable characters of the rig's name become `_`; without a
/// name it is `rig`.
[[nodiscard]] std::optional<std::filesystem::path> state_file(const RigSettings& rig);

/// Configured keys of intrinsics, image regions, transforms and the baseline that differ from the
/// defaults, with their values. A calibration found with other values belongs to another rig.
[[nodiscard]] std::map<std::string, std::string> configured_rig(const Configuration& configuration);

/// Relative difference at which a calibration's baseline and the configured one count as different
/// lengths.
inline constexpr double kOtherLength = 0.02;

/// Result of reading a state file.
struct CalibrationState {
  /// Set if it fits the present rig.
  std::optional<CalibrationFile> calibration{};
  std::string
      /// Reason why an existing file is not used; empty if there is none, or it is used.
      message{};
};

/// Why a calibration is of another number of cameras or other image sizes; empty: it is not.
[[nodiscard]] std::string other_images(const RigCalibration& found, const RigCalibration& expected);

/// Reads the file if there is one. It is used only for the rig it was found on: equal number and
/// sizes of cameras, equal serial numbers in the same order, equal configured_rig(), and a baseline
/// that differs by less than kOtherLength. Does not throw.
[[nodiscard]] CalibrationState read_state(const std::filesystem::path& file,
                                          const CalibrationFile& expected);

/// Makes the directory if needed and replaces the file durably. Throws InputError.
void write_state(const std::filesystem::path& file, const CalibrationFile& calibration);

}  // namespace vergence::app
