#pragma once
#include "core/calibration/gates.hpp"
#include "core/estimator/background_solve.hpp"

namespace vergence {

/// Compares a solution with the frames since its snapshot and with the calibration in use. It
/// refers to its owner's data and is constructed when a decision is due. All functions are pure.
class SolutionReview {
 public:
  struct Context {
    const EstimatorOptions& options;
    const RigCalibration& nominal;
    /// Null if no calibration is in use.
    const RigCalibration* in_use;
    calibration::CalibrationOrigin source;
    const calibration::TrackLog& log;
    const calibration::FocalCheck& focal;
    bool may_have_changed = true;
  };
  SolutionReview(const calibration::RigSolution& solved, const Context& context) noexcept
      : solved_(solved), context_(context) {}

  /// `must_be_better`: the solution must fit better than the calibration in use.
  [[nodiscard]] calibration::Gate gate(bool must_be_better = true) const noexcept;
  /// Returns true if enough frames that were not in the solve are logged to test the solution. A
  /// failed solution needs none.
  [[nodiscard]] bool held_out_enough() const noexcept;
  /// Compares the solution with the calibration `current`.
  [[nodiscard]] calibration::Assessment assess(
      const RigCalibration& current, calibration::CalibrationOrigin source) const noexcept;
  /// Fills in the decision's depth errors, with the solution as the calibration in use.
  void assess_next(CalibrationDecision* decision) const noexcept;
  /// Makes a CalibrationDecision with the data of the solution; the caller sets the outcome.
  [[nodiscard]] CalibrationDecision decision(Stamp stamp) const noexcept;

 private:
  const calibration::RigSolution& solved_;
  const Context context_;
};

}  // namespace vergence
