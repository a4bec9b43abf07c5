#pragma once
#include "core/calibration/gates.hpp"
#include "core/estimator/background_solve.hpp"

namespace vergence {

/// The solutions of one solve, held against the frames since its snapshot and the calibration in
/// use. Made where a decision is due, of references to what its owner has; decides nothing itself.
/// Threads pure.
class SolutionReview {
 public:
  struct Context {
    const EstimatorOptions& options;
    const RigCalibration& nominal;
    const RigCalibration* in_use;     // null: there is none
    calibration::ClaimSource source;  // of that
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
  /// There are frames that were not used, as many as it takes to hold the solutions against; where
  /// all failed none are needed.
  [[nodiscard]] bool held_out_enough() const noexcept;
  /// Of a calibration that was sought: lenses are taken from the drive where it shows that the ones
  /// in use are off, and holds them well enough; else transforms alone.
  [[nodiscard]] const calibration::RigSolution& sought() const noexcept;
  /// The drive's own measurement of the rig, with the lenses free where they are not believed.
  [[nodiscard]] const calibration::RigSolution& measured() const noexcept;
  [[nodiscard]] calibration::Assessment assess(const calibration::RigSolution& measured,
                                               const RigCalibration& claimed,
                                               calibration::ClaimSource source) const noexcept;
  /// The measurement against `next`, which is in use after this decision.
  void assess_next(const RigCalibration& next, CalibrationDecision* decision) const noexcept;
  /// What a decision about `found` says of it, whatever the outcome.
  [[nodiscard]] CalibrationDecision decision(const calibration::RigSolution& found,
                                             Stamp stamp) const noexcept;

 private:
  [[nodiscard]] bool lenses_are_off() const noexcept;

  const BackgroundSolve::Solved& solved_;
  const Context context_;
};

}  // namespace vergence
