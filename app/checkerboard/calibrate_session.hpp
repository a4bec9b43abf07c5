#pragma once

#include "app/checkerboard/board_calibration.hpp"
#include "app/config/calibration_file.hpp"
#include "app/config/configuration.hpp"
#include "app/runtime/errors.hpp"
#include "app/runtime/progress.hpp"

/// Commands `vergence calibrate target` and `live`. Functions throw InputError for unusable
/// arguments, images or devices.
namespace vergence::app {

struct CalibrateRequest {
  /// Without image sizes, which come with the images.
  BoardCalibrationOptions calibration{};
  /// Path of calibration.yaml.
  std::filesystem::path out{};
  /// Measured baseline in m, for comparison in the report.
  std::optional<double> measured_baseline{};
  /// Live: directory for the images of the used views.
  std::optional<std::filesystem::path> keep_views{};
  bool json = false, quiet = false;
};

/// Calibrates from image files: patterns of each camera, camera 0 first.
[[nodiscard]] ExitCode calibrate_images(const CalibrateRequest& request,
                                        const std::vector<std::vector<std::string>>& patterns);

/// Calibrates from the cameras of a configuration, until coverage is complete or a signal arrives.
[[nodiscard]] ExitCode calibrate_live(const CalibrateRequest& request,
                                      const Configuration& configuration);

/// Calibrates, prints the report on standard output and writes the file; messages go to *progress.
/// `file` has the names and serial numbers. Returns done or not_usable.
[[nodiscard]] ExitCode conclude_calibration(const CalibrateRequest& request,
                                            const std::vector<ImageSize>& sizes,
                                            CalibrationFile file,
                                            const std::vector<BoardView>& views,
                                            Progress* progress);

}  // namespace vergence::app
