#pragma once
#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "app/config/calibration_file.hpp"
#include "app/datasets/stereo_sequence.hpp"

/// The calibration that a command line names: a file of any program, or the few numbers that
/// somebody knows.
namespace vergence::app {

/// What is known of a rig without a calibration: both cameras alike, principal points in the middle
/// of the images.
struct KnownNumbers {
  double focal = 0;     // px
  double baseline = 0;  // m
  CameraModelKind model = CameraModelKind::pinhole_radtan;
  std::vector<double> distortion{};  // 4 or 5; empty: none is known
};

/// `--distortion k1,k2,p1,p2`. InputError: no such list.
[[nodiscard]] std::vector<double> parse_distortion(const std::string& text);

/// calibration.yaml, a Kalibr camchain, ROS camera_info (left.yaml,right.yaml or a folder with
/// them) or OpenCV stereo YAML, told by
/// content, with what is wanted of it applied. `size`: of the images, where a file has none. What a
/// format did not carry over is a sentence of *remarks.
/// Errors     InputError
[[nodiscard]] CalibrationFile read_given_calibration(const std::string& in,
                                                     const CalibrationUse& use,
                                                     const std::optional<ImageSize>& size,
                                                     std::vector<std::string>* remarks);

/// For open_sequence().
[[nodiscard]] GivenCalibration given_calibration(const std::string& in, const CalibrationUse& use,
                                                 std::vector<std::string>* remarks);
[[nodiscard]] GivenCalibration given_calibration(const KnownNumbers& known);

}  // namespace vergence::app
