#pragma once
#include "core/calibration/rig_solver.hpp"
#include "core/types/calibration_decision.hpp"

namespace vergence::calibration {

/// Compares the focal length given with the one that the images show.
///
/// A focal length that is off by a share makes all distances off by it, and neither epipolar lines
/// nor a solve that keeps it fixed show that. A solve with every focal length free by
/// kFocalPriorSigma (RigSolveRequest::measure_focal_lengths) does: turns show it, and so does the
/// flow of a straight drive against the known baseline.
///
/// `found`: such a solve. `given`: what the drive began with. Threads pure.
[[nodiscard]] FocalMeasurement check_focal_length(const RigSolution& found,
                                                  const RigCalibration& given) noexcept;

/// Decides which solves of a drive measure the focal length, and keeps the newest result.
///
/// Threads  measure() on the solver's, the others on the estimator's while no solve runs.
class FocalCheck {
 public:
  /// `enabled`: by the options.
  explicit FocalCheck(bool enabled) noexcept : enabled_(enabled) {}

  /// Call before a solve of `frames` frames; `full`: no solve has more of them. It measures if it
  /// is full or has twice the frames of the last measurement, until a full one has measured the
  /// focal length as it was given: a lens keeps it.
  void begin_solve(std::size_t frames, bool full) noexcept {
    measures_ = enabled_ && !known_ && (full || frames >= 2 * measured_frames_);
    frames_ = frames;
  }
  /// Call after `solved`, the solve of the solver's log that `request` asked for; begins with its
  /// result. Frames before the log's are not used: their posterior assumes the
  /// focal length.
  void measure(RigSolver& solver, RigSolveRequest request, const RigSolution& solved) noexcept;
  /// The solve is over, and its frames count. `full`: no solve has more of them.
  void take(bool full) noexcept;

  [[nodiscard]] const FocalMeasurement& newest() const noexcept { return newest_; }
  /// Time of the measurement in the running solve, or the last one, ms.
  [[nodiscard]] double solve_ms() const noexcept { return solve_ms_; }

 private:
  bool enabled_, measures_ = false;
  bool known_ = false;                            // by a full window, and as it was given
  std::size_t frames_ = 0, measured_frames_ = 0;  // of the running solve, of the newest result
  FocalMeasurement newest_{}, solved_{};
  double solve_ms_ = 0;
};

}  // namespace vergence::calibration
