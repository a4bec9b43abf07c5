#pragma once

#include "app/config/calibration_file.hpp"
#include "app/datasets/image_file.hpp"

/// Calibrations of other programs.
///
/// One reader handles all: a file's syntax (YAML with or without OpenCV's header, JSON, OpenCV's
/// XML, an ini) becomes a tree, whose keys are looked up in a vocabulary of other programs' names
/// (foreign_calibration.cpp). The rig follows from the present parts: intrinsics, and the transform
/// in any of the usual forms (docs/calibration.md).
namespace vergence::app {

using Remarks = std::vector<std::string>;

/// File of a calibration.
struct CalibrationText {
  /// Name for messages; files that it refers to are in its directory.
  std::string name;
  std::string text;
};

/// True if the file is a calibration.yaml of this program. Throws InputError if unreadable.
[[nodiscard]] bool is_own_calibration(const std::filesystem::path& file);

/// Reads any of the formats, detected by content. `in` is a file, two or three with commas, or a
/// directory with left.yaml and right.yaml; `size` is used if a file has none. Applies `use`;
/// unneeded parts may be missing: with length_only and a baseline, intrinsics suffice. Throws
/// InputError with file:line and key for missing, inconsistent, non-finite or unsupported content.
/// The result has passed find_implausible().
[[nodiscard]] CalibrationFile read_any_calibration(const std::string& in,
                                                   const std::optional<ImageSize>& size,
                                                   Remarks* remarks,
                                                   const CalibrationUse& use = {});
/// Parses texts of other programs.
[[nodiscard]] CalibrationFile parse_any_calibration(const std::vector<CalibrationText>& files,
                                                    const std::optional<ImageSize>& size,
                                                    Remarks* remarks,
                                                    const CalibrationUse& use = {});

/// T_BS of a camera's sensor.yaml (EuRoC): p_body = T p_camera. Throws InputError if there is none,
/// or it is not rigid.
[[nodiscard]] Transform read_body_mount(const std::filesystem::path& file);

}  // namespace vergence::app
