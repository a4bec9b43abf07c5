#pragma once
#include "core/calibration/gates.hpp"
#include "core/estimator/background_solve.hpp"

namespace vergence {

/// Compares the solution of a solve with the frames since its snapshot and with the calibration
/// in use. It holds references to its owner's data, is constructed where a decision is due, and
/// does not decide. All functions are pure.
class SolutionReview {
 public:
  struct Context {
    const EstimatorOptions& options;
    const RigCalibration& nominal;
    const RigCalibration* in_use;           // null: there is none
    calibration::CalibrationOrigin source;  // of that
    const calibration::TrackLog& log;
    const calibration::FocalCheck& focal;
    bool may_have_changed = true;  // AcceptanceInput::may_have_changed
  };
  SolutionReview(const calibration::RigSolution& solved, const Context& context) noexcept
      : solved_(solved), context_(context) {}

  /// `must_be_better` than the calibration in use.
  [[nodiscard]] calibration::Gate gate(bool must_be_better = true) const noexcept;
  /// True if enough frames that were not in the solve are logged to test the solution; none are
  /// needed if it failed.
  [[nodiscard]] bool held_out_enough() const noexcept;
  /// Compares the solution with the calibration `current`.
  [[nodiscard]] calibration::Assessment assess(
      const RigCalibration& current, calibration::CalibrationOrigin source) const noexcept;
  /// Compares the solution with itself as the calibration in use after this decision.
  void assess_next(CalibrationDecision* decision) const noexcept;
  /// Makes a CalibrationDecision with the data of the solution; the outcome is left to the caller.
  [[nodiscard]] CalibrationDecision decision(Stamp stamp) const noexcept;

 private:
  const calibration::RigSolution& solved_;
  const Context context_;
};

}  // namespace vergence
