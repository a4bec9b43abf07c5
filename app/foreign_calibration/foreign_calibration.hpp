#pragma once
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "app/foreign_calibration/foreign_formats.hpp"

/// A calibration from whatever program it is of.
namespace vergence::app {

enum class CalibrationFormat : std::uint8_t { vergence, kalibr, ros, opencv };

/// Which format a calibration has, told by content; `in` as of read_any_calibration(). InputError:
/// none of them, or not readable.
[[nodiscard]] CalibrationFormat calibration_format(const std::string& in);

/// Reads any of the formats, told by content. `in`: a file, two with a comma between, or a folder
/// with left.yaml and right.yaml; `size`: where an OpenCV file has none. InputError as
/// read_kalibr() and the others.
[[nodiscard]] CalibrationFile read_any_calibration(const std::string& in,
                                                   const std::optional<ImageSize>& size,
                                                   Remarks* remarks);

namespace detail {
/// The files that IN or OUT stand for; a folder stands for left.yaml and right.yaml in it. A comma
/// stands between two files where there is none of the whole name.
[[nodiscard]] std::vector<std::filesystem::path> files_of(const std::string& text, bool folder);
}  // namespace detail

}  // namespace vergence::app
