#pragma once
#include <array>
#include <string>
#include <vector>

#include "app/checkerboard/board_pattern.hpp"
#include "app/datasets/image_file.hpp"
#include "core/types/calibration.hpp"

/// Lenses and places of a rig's cameras from views of a board, by OpenCV.
namespace vergence::app {

/// One board pose as the cameras saw it.
struct BoardView {
  std::string name{};                               // for messages: the first image's
  std::array<BoardCorners, kMaxCameras> corners{};  // empty: not found there
};

struct BoardCalibrationOptions {
  BoardPattern board{};
  /// Sizes of the cameras' images, px; as many as cameras, 1 to kMaxCameras.
  std::vector<ImageSize> sizes{};
  CameraModelKind model = CameraModelKind::pinhole_radtan;
  bool sixth_order = false;  // radtan: k3 is estimated too; otherwise it is 0
};

struct BoardViewResult {
  std::string name{};
  double rms_px = 0;  // over the corners of all its images, norm of both coordinates
  bool used = false;  // false: rejected, above kRejectedRatio times the median and kNeverRejected
};

struct BoardCameraResult {
  int images = 0;
  double alone_rms_px = 0;  // the camera calibrated by itself
};

struct BoardCalibration {
  /// Sigmas by jackknife over the views, which contains what the corners of one view have in
  /// common; `sigma_noise` with the lenses held. A lens' sigma is not below what OpenCV derives
  /// from the residuals.
  RigCalibration rig{};
  std::vector<BoardViewResult> views{};
  std::vector<Transform> T_left_board{};  // of every view; identity where it is rejected
  std::array<BoardCameraResult, kMaxCameras> cameras{};
  std::string error{};  // why this is no calibration; empty: it is one
};

inline constexpr double kRejectedRatio = 3;  // of the median over the views
/// rms, px: as good as the detector gets on real images; nothing is wrong with such a view.
inline constexpr double kNeverRejected = 0.25;
/// Views that a camera needs; fewer leave focal length and centre open.
inline constexpr std::size_t kMinViews = 3;

/// Each camera alone (calibrateCamera, fisheye::calibrate), then each with camera 0
/// (stereoCalibrate): the first pair of radtan lenses is refined together, all others are held.
/// Views with large residuals are rejected. Of several cameras a view counts where camera 0 and
/// another have it; the others are to be left out before.
/// Errors  InputError: fewer than kMinViews views of a camera. `error`: no convergence, a result
///         that cannot be a rig.
[[nodiscard]] BoardCalibration calibrate_boards(const std::vector<BoardView>& views,
                                                const BoardCalibrationOptions& options);

}  // namespace vergence::app
