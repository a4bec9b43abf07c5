#pragma once
#include <filesystem>
#include <optional>
#include <string>

#include "app/config/configuration.hpp"
#include "app/datasets/stereo_sequence.hpp"
#include "app/runtime/errors.hpp"

namespace vergence::app {

/// `vergence calibrate --drive`: an ordinary recorded drive instead of a board.
struct DriveCalibrationRequest {
  std::filesystem::path data;
  SequenceFormat format = SequenceFormat::kitti;
  BagTopics topics{};                      // of a bag
  std::filesystem::path out;               // calibration.yaml to write
  std::optional<std::string> calibration;  // lenses and length to begin with, of any program
  std::optional<double> baseline;          // m: instead of the file's
  Configuration configuration;
  bool quiet = false;
};

/// Calibrates, writes the file and prints what was found on standard output.
/// → done, not_usable (nothing was found, or the depth is not known well enough)
/// Errors  InputError: data, calibration, a file that cannot be written.
///
///     DriveCalibrationRequest request;
///     request.data = "MH_01_easy";
///     request.format = SequenceFormat::euroc;
///     request.out = "calibration.yaml";
///     const ExitCode code = calibrate_from_drive(request);
[[nodiscard]] ExitCode calibrate_from_drive(const DriveCalibrationRequest& request);

}  // namespace vergence::app
