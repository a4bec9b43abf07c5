#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "app/checkerboard/written_formats.hpp"
#include "app/datasets/foreign_calibration.hpp"

/// Command `vergence calibrate convert IN OUT`.
namespace vergence::app {

/// Parses `vergence`, `kalibr`, `ros` or `opencv`, as validated by the option `--to`.
[[nodiscard]] CalibrationFormat parse_format(const std::string& word);
/// Parses `640x480`. Throws InputError if malformed.
[[nodiscard]] ImageSize parse_size(const std::string& text);

/// Format by the file name: a directory or two `.yaml` with a comma: ros; a name with `camchain`:
/// kalibr; `.yml`, one or two: opencv; any other `.yaml`: vergence. Throws InputError for other
/// names.
[[nodiscard]] CalibrationFormat format_of_name(const std::string& out);

/// Files that are written for `out` in that format.
[[nodiscard]] std::vector<std::filesystem::path> files_written(const std::string& out,
                                                               CalibrationFormat format);
/// Text such as `a Kalibr camchain`.
[[nodiscard]] const char* describe(CalibrationFormat format) noexcept;

struct ConversionRequest {
  /// A file, two with a comma between, or a directory with left.yaml and right.yaml.
  std::string in{}, out{};
  /// Format of `out`; empty: by its name.
  std::optional<CalibrationFormat> format{};
  /// Used if an OpenCV file has no size.
  std::optional<ImageSize> size{};
};

/// Writes each file atomically.
void write_any_calibration(const std::string& out, CalibrationFormat format,
                           const CalibrationFile& calibration, Remarks* remarks);

/// Returns remarks about data that the format lacks. Throws InputError, with nothing written.
[[nodiscard]] Remarks convert_calibration(const ConversionRequest& request);

}  // namespace vergence::app
