#pragma once
#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include "app/config/calibration_file.hpp"
#include "app/config/configuration.hpp"

/// The state file: the last calibration that a drive accepted or confirmed, where the
/// next one begins.
namespace vergence::app {

/// Where the state file of this rig lies: `calibration_state.yaml` in `rig.state_dir`, or in
/// $XDG_STATE_HOME/vergence/NAME, or in ~/.local/state/vergence/NAME. Nothing: `rig.state_dir` is
/// `none`, or the user has no home. Characters of the rig's name that a folder's should not have
/// become `_`; a rig without a name is `rig`.
[[nodiscard]] std::optional<std::filesystem::path> state_file(const RigSettings& rig);

/// Keys of a configuration about lenses, read-out regions, transforms and the baseline that are not
/// at their default, with their values. A calibration found under other ones is of another rig.
[[nodiscard]] std::map<std::string, std::string> configured_rig(const Configuration& configuration);

/// Relative: from here on a calibration's baseline and the configuration's are two lengths.
inline constexpr double kOtherLength = 0.02;

/// Result of reading a state file.
struct CalibrationState {
  std::optional<CalibrationFile> calibration{};  // fits the rig that is there
  std::string
      message{};  // why a file that is there is not used; empty: none is there, or it is used
};

/// Reads the file if there is one. It is used for the rig it was found on: as many cameras of the
/// same sizes, the same serials in the same order, and a configuration that says what it said then
/// (configured_rig()) and whose baseline the one found differs from by less than kOtherLength.
/// Errors  None: a message.
[[nodiscard]] CalibrationState read_state(const std::filesystem::path& file,
                                          const CalibrationFile& expected);

/// Makes the folder if need be and replaces the file durably. Errors  InputError.
void write_state(const std::filesystem::path& file, const CalibrationFile& calibration);

}  // namespace vergence::app
