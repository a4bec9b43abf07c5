#pragma once
#include <optional>
#include <vector>

#include "app/calibration/board_calibration.hpp"

namespace vergence::app {

/// One camera for itself: where a joint adjustment starts.
struct CameraStart {
  Intrinsics lens{};
  std::vector<Transform> T_camera_board{};  // one an image
  std::vector<double> rms_px{};             // one an image
  double rms_all_px = 0;
};

/// radtan from OpenCV's calibrateCamera, equidistant from the best of several focal lengths
/// (OpenCV's fisheye::calibrate ends in wrong minima), then adjusted. Nothing: it does not
/// converge.
[[nodiscard]] std::optional<CameraStart> start_camera(
    const std::vector<const BoardCorners*>& images, const BoardCalibrationOptions& options,
    ImageSize size);

}  // namespace vergence::app
