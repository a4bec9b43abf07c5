#include "core/estimator/online_calibrator.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/calibration/posterior.hpp"
#include "core/estimator/detail/solution_review.hpp"

namespace vergence {
namespace {

using calibration::Gate;
using calibration::RigSolution;

std::size_t max_tracks(const EstimatorOptions& o) noexcept {
  return static_cast<std::size_t>(o.odometry.features);
}

/// Misfit of the calibration in use beyond the noise of the matches, in px from the epipolar lines.
double misfit_px(const CalibrationDecision& d) noexcept {
  const double before = d.held_out_before_px, after = d.held_out_after_px;
  return std::sqrt(std::max(0.0, before * before - after * after));
}

/// Clears the extrinsics of the prior when another rig is adopted; the intrinsics stay.
void clear_rig(std::optional<RigCalibration>* refined) noexcept {
  if (*refined) calibration::assume_transforms(calibration::kUnknownTransform, &**refined);
}

}  // namespace

OnlineCalibrator::OnlineCalibrator(const EstimatorOptions& options, const RigCalibration& rig,
                                   const RigCalibration& nominal, Arena& arena,
                                   BackgroundRunner& solver)
    : options_(options),
      rig_(rig),
      nominal_(nominal),
      state_(options.trust == CalibrationTrust::none ? CalibrationState::none
                                                     : CalibrationState::unverified),
      frames_(options.calibration, max_tracks(options), arena),
      solve_(options, rig, max_tracks(options), arena, solver),
      monitor_(options.monitor, rig.cameras, max_tracks(options), arena) {
  if (!calibrated()) return;
  monitor_.watch(rig_, false);
  monitor_.set_jump_reference(rig_);
  if (rig_.covariance.empty()) {
    refined_ = rig_;
    refined_->inflation = calibration::kUsualInflation;
    calibration::assume_transforms(calibration::kSuppliedTransform, &*refined_);
  }
  frames_.begin_segment();
  frames_.require(frames_.min_to_solve());
}

void OnlineCalibrator::adopt(const CalibrationDecision& found) noexcept {
  state_ = next_state(
      state_, found.verified ? CalibrationTrigger::adopted_verified : CalibrationTrigger::adopted);
  rig_ = found.calibration;
  source_ = calibration::CalibrationOrigin::this_drive;
  clear_rig(&refined_);
  monitor_.expect_map_rebuild();
  frames_.begin_segment();
}

void OnlineCalibrator::keep() noexcept {
  state_ = next_state(state_, CalibrationTrigger::kept);
  // Measurements from before the rig became suspect do not describe the present rig.
  if (search_.cause != CalibrationCause::requested) clear_rig(&refined_);
  monitor_.expect_map_rebuild();
  frames_.begin_segment();
}

void OnlineCalibrator::restore(const RigCalibration& rig) noexcept {
  state_ = next_state(state_, CalibrationTrigger::contradicted);
  rig_ = rig;
  keep();
}

void OnlineCalibrator::adopt_refinement(const RigCalibration& rig) noexcept {
  rig_ = rig;
  source_ = calibration::CalibrationOrigin::this_drive;
  monitor_.expect_map_rebuild();
}

void OnlineCalibrator::map_rebuilt(const odometry::Odometry& odometry) noexcept {
  monitor_.map_rebuilt(odometry.map(), rig_, verified() && solved_from_images());
}

void OnlineCalibrator::clear_frames() noexcept {
  solve_.discard();
  frames_.clear();
  monitor_.reset();
}

void OnlineCalibrator::map_lost() noexcept {
  clear_rig(&refined_);
  clear_frames();
  monitor_.map_lost();
}

void OnlineCalibrator::start_estimation(std::optional<CalibrationCause> cause, std::uint64_t onset,
                                        std::uint64_t now) noexcept {
  search_ = {.cause = cause.value_or(search_.cause), .onset = onset, .since = now};
  state_ = next_state(state_, CalibrationTrigger::suspected);
  gate_ = Gate::open;
  solve_.discard();
  frames_.begin_segment(onset);
  frames_.restart_standing();
  monitor_.begin_unlinked(rig_);
}

Reason OnlineCalibrator::missing() const noexcept {
  if (!estimating()) return Reason::none;
  if (frames_.standing() || gate_ == Gate::needs_motion) return Reason::needs_motion;
  return gate_ == Gate::needs_near_structure ? Reason::needs_near_structure : Reason::none;
}

bool OnlineCalibrator::can_solve() const noexcept { return !solve_.running() && frames_.enough(); }

void OnlineCalibrator::start_solve() noexcept {
  frames_.solve_begun();
  BackgroundSolve::Request request;
  request.rig = rig_;
  request.for_new_rig = estimating();
  RigCalibration prior;
  if (refined_) {
    prior = *refined_;
    request.prior = &prior;
    const calibration::TrackLog& log = frames_.log();
    // The age of a supplied calibration is unknown, and its sigmas include it.
    const Stamp newest = log.frame(log.size() - 1).stamp,
                found = prior.found == Stamp{} ? newest : prior.found;
    const double hours = (newest - found).to_seconds() / 3600.0;
    if (estimating())
      calibration::assume_transforms(calibration::kUnknownTransform, &prior);
    else
      calibration::let_drift(hours, options_.calibration, &prior);
  }
  solve_.start(frames_.log(), request);
}

SolutionReview OnlineCalibrator::review() const noexcept {
  return {solve_.solved(),
          {.options = options_,
           .nominal = nominal_,
           .in_use = calibrated() ? &rig_ : nullptr,
           .source = source_,
           .log = frames_.log(),
           .focal = solve_.focal_check(),
           .may_have_changed = !(estimating() && search_.frames_before_change_dropped)}};
}

std::optional<CalibrationDecision> OnlineCalibrator::decide(Stamp stamp,
                                                            std::uint64_t number) noexcept {
  solve_.clear_waited();
  if (!solve_.running() || !solve_.next_frame()) return std::nullopt;
  // The decision waits for enough held-out frames. At standstill none are logged.
  if (!solve_.outdated(estimating()) && !review().held_out_enough()) return std::nullopt;
  // An estimate is adopted as soon as the frames after its snapshot confirm it, and rejected only
  // when more of them would not help. A refinement waits only for its held-out frames.
  if (solve_.for_new_rig() && !solve_.outdated(estimating()) && !solve_.must_decide()) {
    if (review().gate() != Gate::open) {
      solve_.postpone();
      return std::nullopt;
    }
  }
  return evaluate(stamp, number, false);
}

std::optional<CalibrationDecision> OnlineCalibrator::decide_now(Stamp stamp,
                                                                std::uint64_t number) noexcept {
  if (!solve_.running()) return std::nullopt;
  solve_.finish();
  return evaluate(stamp, number, true);
}

bool OnlineCalibrator::start_last_solve() noexcept {
  const bool more = estimating() || frames_.new_since_solve();
  if (solve_.running() || !more || !frames_.enough_for_any()) return false;
  start_solve();
  return true;
}

std::optional<CalibrationDecision> OnlineCalibrator::evaluate(Stamp stamp, std::uint64_t number,
                                                              bool last) noexcept {
  solve_.close();
  if (solve_.outdated(estimating())) return std::nullopt;
  // Frames of two rigs or out of sync cannot measure a focal length.
  const Gate gate = review().gate(false);
  if (gate != Gate::rig_changed && gate != Gate::out_of_sync)
    solve_.focal_check().accept(frames_.solved_frames() >= frames_.max_frames());
  CalibrationDecision d = solve_.for_new_rig() ? evaluate_estimate(stamp, number)
                                               : evaluate_refinement(stamp, number, last);
  // One knock changes the rig in one solve only.
  const bool changed = solve_.solved().changed_at > 0;
  d.not_rigid = std::exchange(search_.changed_in_solve, changed) && changed;
  d.offset_frames = solve_.solved().offset_frames;
  return d;
}

CalibrationDecision OnlineCalibrator::evaluate_estimate(Stamp stamp,
                                                        std::uint64_t number) noexcept {
  const SolutionReview solution = review();
  gate_ = solution.gate();
  CalibrationDecision d = solution.decision(stamp);
  d.cause = search_.cause;
  d.latency_frames = static_cast<int>(number - search_.since);
  d.onset_frame = search_.onset;
  d.accepted = gate_ == Gate::open;
  d.reason = calibration::reason(gate_);
  solution.assess_next(&d);
  if (!d.accepted) plan_search();
  return d;
}

void OnlineCalibrator::plan_search() noexcept {
  const RigSolution& found = solve_.solved();
  if (gate_ == Gate::depth_unknown || gate_ == Gate::needs_motion ||
      gate_ == Gate::needs_near_structure) {
    // More frames help: sigmas fall with the root of their number.
    const double excess =
        calibration::depth_excess(found.rig, options_.calibration, options_.odometry.pixel_sigma);
    frames_.require(static_cast<std::size_t>(std::ceil(excess * excess * found.frames)));
  } else if (gate_ == Gate::rig_changed) {
    search_.onset = found.changed_at;
    search_.frames_before_change_dropped = true;
    frames_.begin_segment(found.changed_at);
  } else {
    // Solving the same frames again gives the same result, so drop them. Each rejection doubles the
    // frames until the next solve, up to a full log.
    frames_.drop_before(found.newest + 1);
    search_.wait = std::min(std::max(frames_.min_frames(), 2 * search_.wait), frames_.max_frames());
    frames_.require_logged(search_.wait);
  }
}

/// Applies a verification or contradiction and sets the monitor's expected scatter accordingly.
void OnlineCalibrator::apply_assessment(CalibrationTrigger what, double misfit_px) noexcept {
  const CalibrationState before = std::exchange(state_, next_state(state_, what));
  if (state_ == before) return;
  monitor_.watch(rig_, verified() && solved_from_images());
  // A verified supplied calibration keeps its intrinsics, whose errors vary over the image.
  if (verified() && !solved_from_images())
    monitor_.expect_scatter(std::max(options_.monitor.verified_bias_px, misfit_px));
}

CalibrationDecision OnlineCalibrator::evaluate_refinement(Stamp stamp, std::uint64_t number,
                                                          bool last) noexcept {
  const RigSolution& found = solve_.solved();
  const SolutionReview solution = review();
  gate_ = solution.gate(false);
  CalibrationDecision d = solution.decision(stamp);
  d.cause = CalibrationCause::refinement;
  d.latency_frames = static_cast<int>(number - search_.since);
  d.onset_frame = search_.onset;
  d.is_refinement = true;
  if (found.status == calibration::RigSolveStatus::ok) {
    const calibration::Assessment a = solution.assess(rig_, source_);
    d.reference_depth_m = a.depth_m;
    d.depth_sigma_percent = a.sigma_percent;
    d.depth_error_percent = a.difference_percent;
    d.evidence = a.evidence;
    d.certainty = a.certainty;
    if (a.contradicted) d.cause = CalibrationCause::contradicted;
    // At the end no held-out frames are left; the solution of more frames is better.
    const calibration::TrackLog& log = frames_.log();
    const bool better = last && log.frame(log.size() - 1).number == found.newest
                            ? source_ == calibration::CalibrationOrigin::this_drive
                            : a.better;
    if (gate_ == Gate::open && !better && !(a.contradicted && !a.worse)) gate_ = Gate::no_better;
    // A verified calibration is not replaced by one that would not be.
    const bool certain = a.sigma_percent <= options_.calibration.max_depth_error_percent;
    if (gate_ == Gate::open && verified() && !certain && !a.contradicted) gate_ = Gate::no_better;
    // Frames that contradict earlier measurements verify nothing.
    d.verified = gate_ == Gate::open
                     ? certain
                     : a.verified && a.sigma_percent > 0 && calibration::of_this_rig(gate_);
    d.verified = d.verified && !d.focal.doubted;
    if (d.verified)
      apply_assessment(CalibrationTrigger::verified, misfit_px(d));
    else if (a.contradicted || d.focal.contradicted)
      apply_assessment(CalibrationTrigger::contradicted, misfit_px(d));
  }
  d.accepted = gate_ == Gate::open;
  d.reason = calibration::reason(gate_);
  if (d.accepted && d.cause == CalibrationCause::contradicted) clear_rig(&refined_);
  plan_refinement();
  return d;
}

/// Closes a full segment, whose result is the prior of the next one. A segment that later frames
/// contradict is closed as well, because its frames are of another rig.
void OnlineCalibrator::plan_refinement() noexcept {
  const RigSolution& found = solve_.solved();
  const bool usable = gate_ == Gate::open || gate_ == Gate::no_better;
  if (gate_ == Gate::does_not_fit) {
    frames_.begin_segment(found.newest + 1);
  } else if (gate_ == Gate::rig_changed) {
    frames_.begin_segment(found.changed_at);
  } else if (frames_.solved_frames() >= frames_.max_frames()) {
    if (usable) refined_ = found.rig;
    frames_.begin_segment(found.newest + 1);
    frames_.require_full();
  } else {
    // Sigmas fall with the root of the number of frames.
    frames_.require(2 * frames_.solved_frames());
  }
}

}  // namespace vergence
