#pragma once
#include <array>
#include <utility>

#include "app/datasets/foreign_calibration.hpp"

/// Command `vergence calibrate convert IN OUT`: calibrations in other programs' file formats.
///
/// Model    X_camera = R X_left + t, T_camera_left = [R t] in metres; pixel centres at integers;
///          radtan k1 k2 p1 p2 [k3], equidistant k1 … k4. All formats share pixels, metres, axes (x
///          right, y down, z forward) and the two distortion models.
/// Errors   InputError if the format lacks something required.
/// Remarks  One message for each item that is not carried over.
namespace vergence::app {

enum class CalibrationFormat : std::uint8_t { vergence, kalibr, ros, opencv };

/// Parses `640x480`. Throws InputError if malformed.
[[nodiscard]] ImageSize parse_size(const std::string& text);

/// Format by a value of `--to`, or else by the file name: a directory or two `.yaml` with a comma
/// is ros, a name with `camchain` kalibr, `.yml`, one or two, opencv, any other `.yaml` vergence.
/// Throws InputError for other names.
[[nodiscard]] CalibrationFormat format_of(const std::string& word, const std::string& out);

/// Text such as `a Kalibr camchain`.
[[nodiscard]] const char* describe(CalibrationFormat format) noexcept;

/// Kalibr camchain: cam0, cam1 … with T_cn_cnm1, X_cn = T_cn_cnm1 X_cn-1.
[[nodiscard]] std::string format_kalibr(const CalibrationFile& calibration, Remarks* remarks);

/// ROS camera_info of a stereo pair, left and right, rectified as in recordings.
[[nodiscard]] std::array<std::string, 2> format_ros(const CalibrationFile& calibration,
                                                    Remarks* remarks);

/// OpenCV's intrinsics and extrinsics, without the head of a file.
[[nodiscard]] std::array<std::string, 2> format_opencv(const CalibrationFile& calibration,
                                                       Remarks* remarks);

/// Files and their content: OUT, the two that it names, separated by a comma, or for ros left.yaml
/// and right.yaml in the directory OUT. Throws InputError if the format has no second file.
using WrittenFiles = std::vector<std::pair<std::filesystem::path, std::string>>;
[[nodiscard]] WrittenFiles format_calibration_as(CalibrationFormat format, const std::string& out,
                                                 const CalibrationFile& calibration,
                                                 Remarks* remarks);

struct ConversionRequest {
  /// A file, two separated by a comma, or a directory with the two.
  std::string in{};
  /// As `in`.
  std::string out{};
  CalibrationFormat format = CalibrationFormat::vergence;
  /// Used if an OpenCV file has no size.
  std::optional<ImageSize> size{};
  /// Overwrites existing files.
  bool force = false;
};

/// Writes each file atomically. Returns messages about what was written and what the format lacks.
/// Throws InputError, with nothing written.
[[nodiscard]] Remarks convert_calibration(const ConversionRequest& request);

}  // namespace vergence::app
