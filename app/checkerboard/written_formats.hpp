#pragma once
#include <array>
#include <span>
#include <string>

#include "app/datasets/foreign_calibration.hpp"

/// Calibrations in other programs' file formats.
///
/// Model    X_camera = R X_left + t, T_camera_left = [R t] in metres; pixel centres at integers;
///          radtan k1 k2 p1 p2 [k3], equidistant k1 … k4. All formats share pixels, metres, axes (x
///          right, y down, z forward) and the two distortion models.
/// Errors   InputError if the format lacks something required.
/// Remarks  One message for each item that is not carried over.
namespace vergence::app {

/// Kalibr camchain: cam0, cam1 … with T_cn_cnm1, X_cn = T_cn_cnm1 X_cn-1.
[[nodiscard]] std::string format_kalibr(const CalibrationFile& calibration, Remarks* remarks);

/// ROS camera_info of a stereo pair, left and right. Rectified by OpenCV's stereoRectify (fisheye's
/// for equidistant) to the same size without black edges.
[[nodiscard]] std::array<std::string, 2> format_ros(const CalibrationFile& calibration,
                                                    Remarks* remarks);

/// OpenCV's intrinsics and extrinsics without the header `%YAML:1.0`; a file may hold either or
/// both.
[[nodiscard]] std::array<std::string, 2> format_opencv(const CalibrationFile& calibration,
                                                       Remarks* remarks);

/// List `[a, b, c]` with as many digits as reproduce the doubles.
[[nodiscard]] std::string number_list(std::span<const double> values);

namespace detail {
/// Adds remarks about data that all these formats lack; `serials`, `names`: the format lacks those,
/// too.
void remark_lost(const CalibrationFile& calibration, const char* format, Remarks* remarks);
/// Checks a calibration for a format with one pair of cameras, and adds a remark about additional
/// cameras. Throws InputError if the two cameras differ in model or size.
void check_pair(const CalibrationFile& calibration, const char* format, Remarks* remarks);
}  // namespace detail

}  // namespace vergence::app
