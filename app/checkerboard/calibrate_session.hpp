#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "app/checkerboard/board_calibration.hpp"
#include "app/config/configuration.hpp"
#include "app/runtime/errors.hpp"
#include "app/runtime/progress.hpp"

/// `vergence calibrate target` and `live`. All of it throws InputError where arguments, images or
/// devices cannot be used.
namespace vergence::app {

struct CalibrateRequest {
  BoardPattern board{};
  CameraModelKind model = CameraModelKind::pinhole_radtan;
  bool sixth_order = false;                   // k3 of radtan
  std::filesystem::path out{};                // calibration.yaml
  std::optional<double> measured_baseline{};  // m, to report against
  std::optional<std::filesystem::path>
      keep_views{};  // live: a folder for the images of the views taken
  bool json = false, quiet = false;
};

/// From image files: patterns of each camera, camera 0 first.
[[nodiscard]] ExitCode calibrate_images(const CalibrateRequest& request,
                                        const std::vector<std::vector<std::string>>& patterns);

/// From the cameras of a configuration, until nothing is missing or a signal comes.
[[nodiscard]] ExitCode calibrate_live(const CalibrateRequest& request,
                                      const Configuration& configuration);

/// Data of a rig in addition to its views.
struct CalibratedRig {
  std::string rig_name{};
  std::vector<std::string> names{}, serials{};  // one a camera
  std::vector<ImageSize> sizes{};
};

/// Calibrates, prints the report on standard output and writes the file; messages go through
/// *progress. → done, not_usable
[[nodiscard]] ExitCode conclude_calibration(const CalibrateRequest& request,
                                            const CalibratedRig& rig,
                                            const std::vector<BoardView>& views,
                                            Progress* progress);

}  // namespace vergence::app
