#pragma once
#include <array>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "app/calibration/board_pattern.hpp"
#include "core/types/calibration.hpp"

namespace vergence::app {

/// One board pose as the cameras saw it.
struct BoardView {
  std::string name{};                               // for sentences: the first image's
  std::array<BoardCorners, kMaxCameras> corners{};  // empty: not found there
};

/// Which numbers of the rig are free: of every camera fx, fy, cx, cy and the first `distortion`
/// coefficients (radtan k1 k2 p1 p2 [k3], equidistant k1 … k4), of every camera but the first its
/// place, as (rotation, translation) of the left perturbation.
class BoardParameters {
 public:
  BoardParameters(int cameras, int distortion) noexcept
      : cameras_(cameras), lens_(4 + distortion) {}
  [[nodiscard]] int cameras() const noexcept { return cameras_; }
  [[nodiscard]] int lens_size() const noexcept { return lens_; }
  [[nodiscard]] int lens(int camera) const noexcept { return camera * lens_; }
  [[nodiscard]] int places() const noexcept { return cameras_ * lens_; }  // the first of them all
  [[nodiscard]] int place(int camera) const noexcept { return places() + 6 * (camera - 1); }
  [[nodiscard]] int size() const noexcept { return places() + 6 * (cameras_ - 1); }

 private:
  int cameras_, lens_;
};

/// The rig and where the board stood, before and after.
struct BoardProblem {
  BoardPattern board{};
  std::vector<BoardView> views{};
  RigCalibration rig{};
  std::vector<Transform> T_left_board{};  // one a view
};

struct BoardSolution {
  bool converged = false;
  int steps = 0;
  std::size_t corners = 0;  // in all images
  double squared_px2 = 0;   // sum over the corners of |residual|²
  double variance_px2 = 0;  // of one coordinate: squared over (2 · corners − parameters)
  /// (JᵀJ)⁻¹ · variance of the rig's numbers, board poses eliminated; with `places_given_lenses`
  /// those of the places alone, lenses held.
  Eigen::MatrixXd covariance{}, places_given_lenses{};
  /// Row v: by how much the rig's numbers would move if view v were left out (first order).
  Eigen::MatrixXd without{};
};

/// Least squares over lenses, places and board poses of all views together:  Σ |project_k(T_k_left
/// T_left_board X) − corner|².
///
/// Levenberg–Marquardt with the poses eliminated (Schur); derivatives are those of core/camera.
/// Pinhole with radtan or equidistant distortion, one to kMaxCameras cameras, views that some
/// cameras do not have. The start has to project every corner.
/// Not core/bundle, which eliminates the points: a board's points are known, its poses are what is
/// eliminated, and wanted are the joint covariance of all lenses and places and each view's
/// influence on them, which a fixed arena has no room for.
/// Memory ordinary. Errors  Not converged: the problem is as the last good step left it.
[[nodiscard]] BoardSolution solve_boards(BoardProblem* problem, const BoardParameters& parameters);

/// Root mean square over the corners of a view in px (norm of both coordinates); infinite where a
/// corner does not project.
[[nodiscard]] double view_rms(const BoardProblem& problem, std::size_t view);

}  // namespace vergence::app
