#pragma once
#include <array>
#include <string>
#include <vector>

#include "app/calibration/board_bundle.hpp"
#include "app/datasets/image_file.hpp"

/// Lenses and places of a rig's cameras from views of a checkerboard.
namespace vergence::app {

struct BoardCalibrationOptions {
  BoardPattern board{};
  std::vector<ImageSize>
      sizes{};  // of the cameras' images, px; as many as cameras, 1 to kMaxCameras
  CameraModelKind model = CameraModelKind::pinhole_radtan;
  bool sixth_order = false;  // radtan: k3 is estimated too; otherwise it is 0
};

struct BoardViewResult {
  std::string name{};
  double rms_px = 0;  // over the corners of all its images, norm of both coordinates
  bool used = false;  // else refused: more than kRefusedRatio times the median, and kNeverRefused
};

struct BoardCameraResult {
  int images = 0;
  double alone_rms_px = 0;          // the camera calibrated for itself
  double rms_px = 0;                // all together
  std::array<double, 9> noise{};    // sigmas of fx fy cx cy d0 … d4 from (JᵀJ)⁻¹
  std::array<double, 9> between{};  // the same by jackknife over views
};

struct BoardCalibration {
  RigCalibration rig{};  // sigmas of places from (JᵀJ)⁻¹; noise: lenses held, wide: lenses
                         // estimated with the places; of lenses the larger of noise and jackknife
  std::vector<BoardViewResult> views{};
  std::vector<Transform> T_left_board{};  // of every view; of refused ones as a first guess has it
  std::array<BoardCameraResult, kMaxCameras> cameras{};
  double corner_sigma_px = 0;  // of one coordinate
  /// Sigmas of the places by leaving out one view after the other (jackknife, first order):
  /// contains what the corners of one view have in common, a board that is not flat, a camera that
  /// moved. rad, m.
  std::array<std::array<double, 6>, kMaxCameras> between{};
  double length_between = 0;  // m, of |t| of camera 1
  std::string error{};        // why this is no calibration; empty: it is one
};

inline constexpr double kRefusedRatio = 3;  // of the median over the views
inline constexpr double kNeverRefused =
    0.25;  // px rms: as good as the detector gets on real images; nothing is wrong with such a view
inline constexpr std::size_t kFewestViews =
    3;  // of a camera; less leaves focal length and centre open

/// Every camera for itself (start_camera()), bad views refused, then everything together
/// (solve_boards()). Of several cameras a view counts where camera 0 and another have it; the
/// others are to be left out before.
/// Errors  InputError: fewer than kFewestViews views of a camera. `error`: no convergence, a
///         result that cannot be a rig.
[[nodiscard]] BoardCalibration calibrate_boards(const std::vector<BoardView>& views,
                                                const BoardCalibrationOptions& options);

}  // namespace vergence::app
