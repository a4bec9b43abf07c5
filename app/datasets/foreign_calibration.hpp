#pragma once
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "app/config/calibration_file.hpp"
#include "app/datasets/image_file.hpp"

/// A calibration from whatever program it is of.
///
/// There is one reader: a file's syntax (YAML with or without OpenCV's head, JSON, OpenCV's XML, an
/// ini) becomes one tree, whose keys are looked up in a vocabulary of what programs call the parts
/// of a calibration (vocabulary.hpp). From the parts that are there the rig follows: lenses, and
/// the transform from whichever of the usual forms tells it (docs/calibration.md).
namespace vergence::app {

using Remarks = std::vector<std::string>;

enum class CalibrationFormat : std::uint8_t { vergence, kalibr, ros, opencv };

/// One file of a calibration.
struct CalibrationText {
  std::string name;  // for messages; files that it names lie beside it
  std::string text;
};

/// Returns true if the file is a calibration.yaml of this program. InputError: not readable.
[[nodiscard]] bool is_own_calibration(const std::filesystem::path& file);

/// Reads any of the formats, told by content. `in`: a file, two or three with commas between, or a
/// folder with left.yaml and right.yaml; `size`: where a file has none. What `use` does not want
/// need not be there: with length_only and a baseline lenses are enough. It is applied. InputError
/// with file:line and key: what is missing, has another size, is no finite number, or means a lens
/// or rig that this program has not; what another program's file lacks. A result has passed
/// find_implausible().
[[nodiscard]] CalibrationFile read_any_calibration(const std::string& in,
                                                   const std::optional<ImageSize>& size,
                                                   Remarks* remarks,
                                                   const CalibrationUse& use = {});
/// Parses texts of other programs.
[[nodiscard]] CalibrationFile parse_any_calibration(const std::vector<CalibrationText>& files,
                                                    const std::optional<ImageSize>& size,
                                                    Remarks* remarks,
                                                    const CalibrationUse& use = {});

/// T_BS of one camera's sensor.yaml (EuRoC): p_body = T p_camera. InputError: there is none, or it
/// is no rigid transform.
[[nodiscard]] Transform read_body_mount(const std::filesystem::path& file);

namespace detail {
/// The files that IN or OUT stand for; a folder stands for left.yaml and right.yaml in it. Commas
/// stand between files where there is none of the whole name.
[[nodiscard]] std::vector<std::filesystem::path> files_of(const std::string& text, bool folder);
}  // namespace detail

}  // namespace vergence::app
