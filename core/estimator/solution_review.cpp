#include "core/estimator/detail/solution_review.hpp"

namespace vergence {

using calibration::Gate;
using calibration::RigSolveStatus;

Gate SolutionReview::gate(bool must_be_better) const noexcept {
  calibration::AcceptanceInput q;
  q.solution = &solved_;
  q.nominal = &context_.nominal;
  q.in_use = context_.in_use;
  q.log = &context_.log;
  q.pixel_sigma = context_.options.odometry.pixel_sigma;
  q.may_have_changed = context_.may_have_changed;
  q.must_be_better = must_be_better;
  const Gate gate = calibration::check_acceptance(q, context_.options.calibration);
  if (gate != Gate::no_better) return gate;
  // A yaw changes depths, but hardly the distances to epipolar lines that the gate compares.
  const calibration::Assessment a = assess(*context_.in_use, context_.source);
  return (a.nearer || a.log_odds < 0) && !a.worse ? Gate::open : gate;
}

bool SolutionReview::held_out_enough() const noexcept {
  return solved_.status != RigSolveStatus::ok ||
         calibration::held_out_enough(context_.log, solved_.newest);
}

calibration::Assessment SolutionReview::assess(
    const RigCalibration& current, calibration::CalibrationOrigin source) const noexcept {
  return calibration::assess(solved_.rig, current, source, context_.log, solved_.newest,
                             context_.options.calibration, context_.options.odometry.pixel_sigma);
}

void SolutionReview::assess_next(CalibrationDecision* decision) const noexcept {
  if (solved_.status != RigSolveStatus::ok) return;
  const calibration::Assessment then =
      assess(solved_.rig, calibration::CalibrationOrigin::this_drive);
  decision->reference_depth_m = then.depth_m;
  decision->depth_sigma_percent = then.sigma_percent;
  // An error of the focal length scales all distances.
  decision->verified = then.verified && !decision->focal.doubted;
  if (context_.in_use != nullptr)
    decision->depth_error_percent = assess(*context_.in_use, context_.source).difference_percent;
}

CalibrationDecision SolutionReview::decision(Stamp stamp) const noexcept {
  CalibrationDecision d;
  d.stamp = stamp;
  d.calibration = solved_.rig;
  d.held_out_after_px = calibration::held_out(context_.log, solved_.newest, solved_.rig).median_px;
  if (context_.in_use != nullptr)
    d.held_out_before_px =
        calibration::held_out(context_.log, solved_.newest, *context_.in_use).median_px;
  d.focal = context_.focal.newest();
  d.solve_ms = solved_.solve_ms + context_.focal.solve_ms();
  return d;
}

}  // namespace vergence
