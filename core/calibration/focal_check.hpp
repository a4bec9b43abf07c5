#pragma once
#include "core/calibration/rig_solver.hpp"
#include "core/types/calibration_decision.hpp"

namespace vergence::calibration {

/// Compares the configured focal length with the one that the images show.
///
/// An error of the focal length scales all distances, and neither epipolar lines nor a solve with
/// fixed intrinsics show it. A solve that frees every focal length within kFocalPriorSigma does, by
/// rotations and by the optical flow of straight motion with the known baseline.
///
/// `found`: such a solve. `given`: the initial calibration. Pure.
[[nodiscard]] FocalMeasurement check_focal_length(const RigSolution& found,
                                                  const RigCalibration& given) noexcept;

/// Measures the focal length after solves of the rig, and keeps the newest result.
///
/// Threads  measure() runs on the solver's thread, the others on the estimator's while no solve
///          runs.
class FocalCheck {
 public:
  explicit FocalCheck(bool enabled) noexcept : enabled_(enabled) {}

  /// Measures the focal length, unless a solve of the maximum number of frames has agreed with the
  /// configured value. Call after `solved`, the result of `request`, the solver's last one.
  void measure(RigSolver& solver, const RigSolveRequest& request,
               const RigSolution& solved) noexcept;
  /// Accepts the measurement of a finished solve. `full`: it had the maximum number of frames.
  void accept(bool full) noexcept;

  [[nodiscard]] const FocalMeasurement& newest() const noexcept { return newest_; }
  /// Duration of the newest measurement, in ms.
  [[nodiscard]] double solve_ms() const noexcept { return solve_ms_; }

 private:
  bool enabled_;
  // True if a full solve has agreed with the configured value.
  bool known_ = false;
  FocalMeasurement newest_{}, solved_{};
  double solve_ms_ = 0;
};

}  // namespace vergence::calibration
