#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "app/checkerboard/written_formats.hpp"
#include "app/datasets/foreign_calibration.hpp"

/// `vergence calibrate convert IN OUT`.
namespace vergence::app {

/// `vergence`, `kalibr`, `ros` or `opencv`, as the option `--to` checks.
[[nodiscard]] CalibrationFormat parse_format(const std::string& word);
/// `640x480`. InputError: no such thing.
[[nodiscard]] ImageSize parse_size(const std::string& text);

/// Returns the format by the file name: a folder or two `.yaml` with a comma: ros; a name with
/// `camchain`: kalibr; `.yml`, one or two: opencv; any other `.yaml`: vergence. InputError: the
/// name does not tell.
[[nodiscard]] CalibrationFormat format_of_name(const std::string& out);

/// The files that writing `out` in that format makes.
[[nodiscard]] std::vector<std::filesystem::path> files_written(const std::string& out,
                                                               CalibrationFormat format);
/// `a Kalibr camchain`.
[[nodiscard]] const char* describe(CalibrationFormat format) noexcept;

struct ConversionRequest {
  std::string in{},
      out{};  // a file, two with a comma between, or a folder with left.yaml and right.yaml
  std::optional<CalibrationFormat> format{};  // of `out`; nothing: by its name
  std::optional<ImageSize> size{};            // where an OpenCV file has none
};

/// Each file whole or not at all.
void write_any_calibration(const std::string& out, CalibrationFormat format,
                           const CalibrationFile& calibration, Remarks* remarks);

/// Remarks: what was not carried. Errors  InputError, nothing written.
[[nodiscard]] Remarks convert_calibration(const ConversionRequest& request);

}  // namespace vergence::app
