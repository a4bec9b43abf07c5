#pragma once

#include "app/checkerboard/board_pattern.hpp"
#include "app/datasets/image_file.hpp"
#include "core/types/calibration.hpp"

/// Intrinsics and extrinsics of a rig from views of a calibration target, by OpenCV.
namespace vergence::app {

/// Pose of the target as seen by the cameras.
struct BoardView {
  /// Name of the first image, for messages.
  std::string name{};
  /// Empty for a camera that does not see the target.
  std::array<BoardCorners, kMaxCameras> corners{};
};

struct BoardCalibrationOptions {
  BoardPattern board{};
  /// Image sizes of the 1 to kMaxCameras cameras, in px.
  std::vector<ImageSize> sizes{};
  CameraModelKind model = CameraModelKind::pinhole_radtan;
  /// Also estimates k3 of radtan; otherwise it is 0.
  bool sixth_order = false;
};

struct BoardViewResult {
  std::string name{};
  /// RMS over the corners of all its images, norm of both coordinates.
  double rms_px = 0;
  /// False if rejected: above kRejectedRatio times the median and kNeverRejected.
  bool used = false;
};

struct BoardCameraResult {
  int images = 0;
  /// RMS of the camera calibrated separately.
  double alone_rms_px = 0;
};

struct BoardCalibration {
  /// Sigmas are from a jackknife over the views, which includes errors common to the corners of a
  /// view; `sigma_noise` is with fixed intrinsics. Sigmas of intrinsics are at least those that
  /// OpenCV derives from the residuals.
  RigCalibration rig{};
  std::vector<BoardViewResult> views{};
  /// Pose of every view; identity if rejected.
  std::vector<Transform> T_left_board{};
  std::array<BoardCameraResult, kMaxCameras> cameras{};
  /// Reason why there is no valid calibration; empty if there is.
  std::string error{};
};

/// Ratio to the median over the views.
inline constexpr double kRejectedRatio = 3;
/// RMS in px that the detector reaches on real images; such a view is never rejected.
inline constexpr double kNeverRejected = 0.25;
/// Minimum number of views per camera; fewer do not determine focal length and principal point.
inline constexpr std::size_t kMinViews = 3;

/// Calibrates each camera separately (calibrateCamera, fisheye::calibrate), then each with camera 0
/// (stereoCalibrate). The first pair of radtan cameras is refined jointly; all other intrinsics are
/// fixed. Views with large residuals are rejected. With several cameras a view needs camera 0 and
/// another; others must be removed before. Throws InputError for fewer than kMinViews views of a
/// camera. `error` reports no convergence or an implausible rig.
[[nodiscard]] BoardCalibration calibrate_boards(const std::vector<BoardView>& views,
                                                const BoardCalibrationOptions& options);

}  // namespace vergence::app
