#pragma once
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "app/config/calibration_file.hpp"
#include "app/config/yaml_file.hpp"
#include "app/datasets/image_file.hpp"

/// Calibrations in other programs' files, as pure functions of their text.
///
/// Ours     X_camera = R X_left + t, T_camera_left = [R t], metres; pixel centres at integers;
///          radtan k1 k2 p1 p2 [k3], equidistant k1 …
/// k4.
///          All formats here share pixels, metres, axes (x right, y down, z forward) and the two
///          distortion models.
/// Errors   InputError with file:line and key: what is missing, has another size, is no finite
///          number, or means a lens or rig that this program has not. Reading: find_implausible()
///          has passed. Writing: the format has no place for what images would need.
/// Remarks  One sentence each for what is not carried over.
namespace vergence::app {

using Remarks = std::vector<std::string>;

/// Kalibr's camchain: cam0, cam1 … with T_cn_cnm1, X_cn = T_cn_cnm1 X_cn-1; pinhole with radtan,
/// equidistant or none. A camera's name is the part of its rostopic before the
/// image.
[[nodiscard]] CalibrationFile read_kalibr(const YamlFile& file, Remarks* remarks);
[[nodiscard]] std::string format_kalibr(const CalibrationFile& calibration, Remarks* remarks);

/// ROS camera_info of a stereo pair: plumb_bob, equidistant, or rational_polynomial where it is
/// plumb_bob. With rectifications R_l, R_r and
/// P_r[3] = −fx B:  X_right = R_rᵀ (R_l X_left + (P_r[3]/fx, 0, 0)).
[[nodiscard]] CalibrationFile read_ros(const YamlFile& left, const YamlFile& right,
                                       Remarks* remarks);
/// Left and right. Rectified by OpenCV's stereoRectify (fisheye's for equidistant) to the same size
/// without black edges.
[[nodiscard]] std::array<std::string, 2> format_ros(const CalibrationFile& calibration,
                                                    Remarks* remarks);

/// OpenCV's stereo calibration: M1 D1 M2 D2 R T (K1, cameraMatrix1, distCoeffs1 … likewise) in one
/// file or in several, as its sample writes intrinsics.yml and extrinsics.yml; fisheye_model: 1
/// makes it equidistant; four coefficients without that key are a remark. X_2 = R X_1 + T. `size`
/// where the files have none.
[[nodiscard]] CalibrationFile read_opencv(const std::vector<YamlFile>& files,
                                          const std::optional<ImageSize>& size, Remarks* remarks);
/// Intrinsics and extrinsics without the head `%YAML:1.0`; a file may hold either or one after the
/// other.
[[nodiscard]] std::array<std::string, 2> format_opencv(const CalibrationFile& calibration,
                                                       Remarks* remarks);

/// OpenCV's head is no YAML 1.2: it is blanked, so that lines keep their numbers.
[[nodiscard]] YamlFile parse_opencv_yaml(std::string text, const std::string& name);

namespace detail {
/// Throws as read_…() where the result cannot be a rig.
void check_read(const std::string& name, CalibrationFile* calibration);
/// Remarks what every one of these formats lacks; `serials`, `names`: the format lacks those, too.
void remark_lost(const CalibrationFile& calibration, const char* format, bool names,
                 Remarks* remarks);
/// Remarks cameras beyond the pair that a format holds.
void remark_more_cameras(const CalibrationFile& calibration, const char* format, Remarks* remarks);
}  // namespace detail

}  // namespace vergence::app
