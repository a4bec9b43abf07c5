#pragma once
#include "core/calibration/gates.hpp"
#include "core/estimator/background_solve.hpp"

namespace vergence {

/// Compares the solutions of one solve with the frames since its snapshot and with the calibration
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
    bool last = false;             // no more frames come that could make a solution better
  };
  SolutionReview(const BackgroundSolve::Solved& solved, const Context& context) noexcept
      : solved_(solved), context_(context) {}

  /// `must_be_better` than the calibration in use.
  [[nodiscard]] calibration::Gate gate(const calibration::RigSolution& found,
                                       bool must_be_better = true) const noexcept;
  /// True if enough frames that were not in the solve are logged to test the solutions; none are
  /// needed if all solutions failed.
  [[nodiscard]] bool held_out_enough() const noexcept;
  /// The solution to use while seeking: the one with the lenses free if it shows that those in use
  /// are off and determines them well enough, else the one of the transforms only.
  [[nodiscard]] const calibration::RigSolution& best() const noexcept;
  /// The drive's own measurement of the rig, with the lenses free where they are not believed.
  [[nodiscard]] const calibration::RigSolution& measured() const noexcept;
  [[nodiscard]] calibration::Assessment assess(
      const calibration::RigSolution& measured, const RigCalibration& current,
      calibration::CalibrationOrigin source) const noexcept;
  /// The measurement against `next`, which is in use after this decision.
  void assess_next(const RigCalibration& next, CalibrationDecision* decision) const noexcept;
  /// Makes a CalibrationDecision with the data of `found`; the outcome is left to the caller.
  [[nodiscard]] CalibrationDecision decision(const calibration::RigSolution& found,
                                             Stamp stamp) const noexcept;

 private:
  [[nodiscard]] bool lenses_are_off() const noexcept;

  const BackgroundSolve::Solved& solved_;
  const Context context_;
};

}  // namespace vergence
