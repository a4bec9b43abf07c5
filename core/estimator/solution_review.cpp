#include "core/estimator/detail/solution_review.hpp"

namespace vergence {

using calibration::Gate;
using calibration::RigSolution;
using calibration::RigSolveStatus;

Gate SolutionReview::gate(const RigSolution& found, bool must_be_better) const noexcept {
  calibration::AcceptanceInput q;
  q.solution = &found;
  q.nominal = &context_.nominal;
  q.in_use = context_.in_use;
  q.log = &context_.log;
  q.lenses = &found == &solved_.lenses;
  q.pixel_sigma = context_.options.odometry.pixel_sigma;
  q.may_have_changed = context_.may_have_changed;
  q.must_be_better = must_be_better;
  q.window_full = context_.last || found.frames >= context_.options.calibration.max_frames;
  const Gate gate = calibration::check_acceptance(q, context_.options.calibration);
  if (gate != Gate::no_better) return gate;
  // A yaw hardly shows beside the epipolar lines that the gate asks about, and in the depth it
  // does.
  const calibration::Assessment a = assess(found, *context_.in_use, context_.source);
  return (a.nearer || a.log_odds < 0) && !a.worse ? Gate::open : gate;
}

bool SolutionReview::held_out_enough() const noexcept {
  for (const RigSolution* found : {&solved_.transforms, &solved_.lenses})
    if (found->status == RigSolveStatus::ok)
      return calibration::held_out_enough(context_.log, found->newest);
  return true;
}

const RigSolution& SolutionReview::best() const noexcept {
  return lenses_are_off() ? solved_.lenses : solved_.transforms;
}

const RigSolution& SolutionReview::measured() const noexcept {
  return context_.options.calibration.intrinsics == calibration::IntrinsicsEstimation::full
             ? solved_.lenses
             : solved_.transforms;
}

bool SolutionReview::lenses_are_off() const noexcept {
  const RigSolution &free = solved_.lenses, &held = solved_.transforms;
  if (free.status != RigSolveStatus::ok || gate(free, false) != Gate::open) return false;
  return held.status != RigSolveStatus::ok ||
         calibration::fits_better(context_.log, free.newest, free.rig, held.rig);
}

calibration::Assessment SolutionReview::assess(
    const RigSolution& measured, const RigCalibration& current,
    calibration::CalibrationOrigin source) const noexcept {
  return calibration::assess(measured.rig, current, source, context_.log, measured.newest,
                             context_.options.calibration, context_.options.odometry.pixel_sigma);
}

void SolutionReview::assess_next(const RigCalibration& next,
                                 CalibrationDecision* decision) const noexcept {
  const RigSolution& found = measured();
  if (found.status != RigSolveStatus::ok) return;
  const calibration::Assessment then =
      assess(found, next, calibration::CalibrationOrigin::this_drive);
  decision->reference_depth_m = then.depth_m;
  decision->depth_sigma_percent = then.sigma_percent;
  // All distances are off by what the focal length is off by.
  decision->verified = then.confirmed && !decision->focal.contradicted;
  if (context_.in_use != nullptr)
    decision->depth_error_percent =
        assess(found, *context_.in_use, context_.source).difference_percent;
}

CalibrationDecision SolutionReview::decision(const RigSolution& found, Stamp stamp) const noexcept {
  CalibrationDecision d;
  d.stamp = stamp;
  d.calibration = found.rig;
  d.lenses = &found == &solved_.lenses;
  d.held_out_after_px = calibration::held_out(context_.log, found.newest, found.rig).median_px;
  if (context_.in_use != nullptr)
    d.held_out_before_px =
        calibration::held_out(context_.log, found.newest, *context_.in_use).median_px;
  d.focal = context_.focal.newest();
  d.solve_ms = solved_.transforms.solve_ms + solved_.lenses.solve_ms + context_.focal.solve_ms();
  return d;
}

}  // namespace vergence
