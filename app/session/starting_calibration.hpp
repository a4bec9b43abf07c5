#pragma once
#include <array>

#include "app/config/configuration.hpp"
#include "app/datasets/stereo_sequence.hpp"
#include "core/estimator/estimator.hpp"

/// Initial calibration, in order of precedence: --from-scratch, --calibration FILE, the state file,
/// the configuration.
namespace vergence::app {

/// Assumptions about a rig without a calibration: equal cameras, principal points in the middle of
/// the images.
struct AssumedIntrinsics {
  /// In px.
  double focal = 0;
  /// In m.
  double baseline = 0;
  CameraModelKind model = CameraModelKind::pinhole_radtan;
  /// Starts with the distortion of a typical lens of 80 to 100 degrees.
  bool wide = false;
};

/// Calibration for open_sequence().
[[nodiscard]] GivenCalibration given_calibration(const std::string& in, const CalibrationUse& use,
                                                 std::vector<std::string>* remarks);
[[nodiscard]] GivenCalibration given_calibration(const AssumedIntrinsics& known);

/// Request of the command line.
struct CalibrationSource {
  bool from_scratch = false;
  /// Value of --calibration; with from_scratch only its intrinsics and length are used.
  std::optional<std::filesystem::path> file{};
};

struct StartingCalibration {
  /// Calibration for the estimator, with the cameras' names and serials and, in a live run, the
  /// configured values. From scratch T_camera_left is parallel.
  CalibrationFile file{};
  /// Calibration that the plausibility gates compare with.
  RigCalibration nominal{};
  CalibrationTrust trust = CalibrationTrust::given;
  /// Value in calibrations.csv.
  const char* cause = "given";
  /// Short description of the origin.
  std::string source{};
  /// Messages for the user.
  std::vector<std::string> remarks{};
  /// File that stores an accepted calibration; empty if none.
  std::optional<std::filesystem::path> state{};
};

/// Initial calibration of a live run. `serials` are the cameras' own, if any, else the configured
/// ones are used. It is also from scratch if the cameras are real and neither a file nor the
/// configuration has extrinsics. Throws InputError for a file that is damaged or of another rig. An
/// unused state file gives a remark.
[[nodiscard]] StartingCalibration starting_calibration(const Configuration& configuration,
                                                       const CalibrationSource& source,
                                                       const std::vector<std::string>& serials);

/// Initial calibration of a replay; the sequence must be opened with the same from_scratch. State
/// files are neither read nor written.
[[nodiscard]] StartingCalibration replayed_calibration(const Configuration& configuration,
                                                       const StereoSequence& sequence,
                                                       bool from_scratch);

/// Nominal geometry for the gates: parallel cameras a baseline apart. A camera mounted further from
/// there than the gates permit keeps its pose in `mounted`.
[[nodiscard]] RigCalibration nominal_geometry(const RigCalibration& given,
                                              const RigCalibration& mounted,
                                              const calibration::CalibrationOptions& options);

/// `masks` by camera and `frame_budget` are those of EstimatorOptions.
[[nodiscard]] EstimatorOptions estimator_options(
    const Configuration& configuration, CalibrationTrust trust, Adoption adoption,
    const std::array<ImageView, kMaxCameras>& masks = {}, Duration frame_budget = {});

}  // namespace vergence::app
