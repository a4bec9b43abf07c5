#pragma once
#include "core/calibration/rig_solver.hpp"
#include "core/types/calibration_decision.hpp"

namespace vergence::calibration {

/// Compares the configured focal length with the one that the images show.
///
/// An error of the focal length scales all distances, and neither epipolar lines nor a solve with
/// fixed intrinsics show it. A solve that frees every focal length within kFocalPriorSigma
/// (RigSolveRequest::measure_focal_lengths) does, by rotations and by the optical flow of straight
/// motion with the known baseline.
///
/// `found`: such a solve. `given`: the initial calibration. Pure.
[[nodiscard]] FocalMeasurement check_focal_length(const RigSolution& found,
                                                  const RigCalibration& given) noexcept;

/// Decides which solves measure the focal length, and keeps the newest result.
///
/// Threads  measure() runs on the solver's thread, the others on the estimator's while no solve
///          runs.
class FocalCheck {
 public:
  explicit FocalCheck(bool enabled) noexcept : enabled_(enabled) {}

  /// Call before a solve of `frames` frames; `full`: the maximum number. The solve measures the
  /// focal length if it is full or has twice the frames of the last measurement. After a full solve
  /// has agreed with the configured value, no more are measured.
  void begin_solve(std::size_t frames, bool full) noexcept {
    measures_ = enabled_ && !known_ && (full || frames >= 2 * measured_frames_);
    frames_ = frames;
  }
  /// Call after `solved`, the result of `request` on the solver's log, which is the starting point.
  /// The posterior of earlier frames is not used, because it assumes the focal length.
  void measure(RigSolver& solver, RigSolveRequest request, const RigSolution& solved) noexcept;
  /// Accepts the measurement of a finished solve. `full`: it had the maximum number of frames.
  void accept(bool full) noexcept;

  [[nodiscard]] const FocalMeasurement& newest() const noexcept { return newest_; }
  /// Duration of the newest measurement, in ms.
  [[nodiscard]] double solve_ms() const noexcept { return solve_ms_; }

 private:
  bool enabled_, measures_ = false;
  // True if a full solve has agreed with the configured value.
  bool known_ = false;
  // Numbers of frames of the running solve and of the newest result.
  std::size_t frames_ = 0, measured_frames_ = 0;
  FocalMeasurement newest_{}, solved_{};
  double solve_ms_ = 0;
};

}  // namespace vergence::calibration
