#pragma once
#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "app/config/calibration_file.hpp"
#include "app/config/configuration.hpp"
#include "app/datasets/stereo_sequence.hpp"
#include "core/estimator/estimator.hpp"

/// Initial calibration, in this order: --from-scratch before --calibration FILE before the state
/// file before the configuration.
namespace vergence::app {

/// Assumptions about a rig without a calibration: both cameras alike, principal points in the
/// middle of the images.
struct AssumedIntrinsics {
  double focal = 0;     // px
  double baseline = 0;  // m
  CameraModelKind model = CameraModelKind::pinhole_radtan;
  bool wide = false;  // begins with the distortion of a usual lens of 80 to 100 degrees
};

/// calibration.yaml, a Kalibr camchain, ROS camera_info (left.yaml,right.yaml or a folder with
/// them) or OpenCV stereo YAML, told by
/// content, with what is wanted of it applied. `size`: of the images, where a file has none. What a
/// format did not carry over is a message of *remarks.
/// Errors     InputError
[[nodiscard]] CalibrationFile read_given_calibration(const std::string& in,
                                                     const CalibrationUse& use,
                                                     const std::optional<ImageSize>& size,
                                                     std::vector<std::string>* remarks);

/// For open_sequence().
[[nodiscard]] GivenCalibration given_calibration(const std::string& in, const CalibrationUse& use,
                                                 std::vector<std::string>* remarks);
[[nodiscard]] GivenCalibration given_calibration(const AssumedIntrinsics& known);

/// Request of the command line.
struct CalibrationSource {
  bool from_scratch = false;
  std::optional<std::filesystem::path>
      file{};  // --calibration; with from_scratch its intrinsics and its length only
};

struct StartingCalibration {
  CalibrationFile file{};  // what the estimator is given, with the cameras' names and serials, and
                           // of a drive what the configuration says; from scratch T_camera_left is
                           // parallel
  RigCalibration nominal{};  // what the gates compare with
  CalibrationTrust trust = CalibrationTrust::given;
  const char* cause = "given";                   // of calibrations.csv
  std::string source{};                          // a few words: what it is from
  std::vector<std::string> remarks{};            // messages for the user
  std::optional<std::filesystem::path> state{};  // where an accepted one is kept; nothing: nowhere
};

/// Initial calibration of a live run. `serials`: the cameras' own, as far as they have one; else
/// the configuration names them. From scratch, too, where the cameras are real and neither a file
/// nor the configuration says where they sit. Errors InputError: a file that is damaged or of
/// another rig. A state file that is not used is a remark.
[[nodiscard]] StartingCalibration starting_calibration(const Configuration& configuration,
                                                       const CalibrationSource& source,
                                                       const std::vector<std::string>& serials);

/// Initial calibration of a replay; the sequence was opened with the same from_scratch. State files
/// are neither read nor written.
[[nodiscard]] StartingCalibration replayed_calibration(const Configuration& configuration,
                                                       const StereoSequence& sequence,
                                                       bool from_scratch);

/// Nominal geometry for the gates: parallel cameras a baseline apart; of a camera that is mounted
/// farther from there than the gates let through, its place in `mounted`.
[[nodiscard]] RigCalibration nominal_geometry(const RigCalibration& given,
                                              const RigCalibration& mounted,
                                              const calibration::CalibrationOptions& options);

/// `masks` by camera and `frame_budget` as EstimatorOptions has them.
[[nodiscard]] EstimatorOptions estimator_options(
    const Configuration& configuration, CalibrationTrust trust, Adoption adoption,
    const std::array<ImageView, kMaxCameras>& masks = {}, Duration frame_budget = {});

}  // namespace vergence::app
