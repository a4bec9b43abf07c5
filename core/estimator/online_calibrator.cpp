#include "core/estimator/online_calibrator.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "core/calibration/posterior.hpp"

namespace vergence {
namespace {

using calibration::Gate;
using calibration::RigSolveStatus;

std::size_t max_tracks(const EstimatorOptions& o) noexcept {
  return static_cast<std::size_t>(o.odometry.features);
}

/// Misfit of the calibration in use beyond the noise of the matches, in px from the epipolar lines.
double misfit_px(const CalibrationDecision& d) noexcept {
  const double before = d.held_out_before_px, after = d.held_out_after_px;
  return std::sqrt(std::max(0.0, before * before - after * after));
}

}  // namespace

OnlineCalibrator::OnlineCalibrator(const EstimatorOptions& options, const RigCalibration& rig,
                                   const RigCalibration& nominal, Arena& arena,
                                   BackgroundRunner& runner)
    : options_(options),
      given_(rig),
      nominal_(nominal),
      rig_(rig),
      state_(options.trust == CalibrationTrust::none ? CalibrationState::none
                                                     : CalibrationState::unverified),
      frames_(options.calibration, max_tracks(options), arena),
      runner_(runner),
      solver_(options.calibration, options.monitor, rig.cameras, max_tracks(options), arena),
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

OnlineCalibrator::~OnlineCalibrator() {
  if (solving_) runner_.wait();
}

void OnlineCalibrator::set_state(CalibrationTrigger what) noexcept {
  if (const auto* edge = find_edge(kCalibrationTransitions, state_, what)) state_ = edge->to;
}

void OnlineCalibrator::adopt(const CalibrationDecision& found) noexcept {
  rig_ = found.calibration;
  source_ = calibration::CalibrationOrigin::this_drive;
  monitor_.expect_map_rebuild();
  if (found.is_refinement) return;
  set_state(found.verified ? CalibrationTrigger::adopted_verified : CalibrationTrigger::adopted);
  clear_prior();
  frames_.begin_segment();
}

void OnlineCalibrator::clear_prior() noexcept {
  if (refined_) calibration::assume_transforms(calibration::kUnknownTransform, &*refined_);
}

void OnlineCalibrator::keep() noexcept {
  set_state(CalibrationTrigger::kept);
  // Measurements from before the rig became suspect do not describe the present rig.
  if (search_.cause != CalibrationCause::requested) clear_prior();
  monitor_.expect_map_rebuild();
  frames_.begin_segment();
}

void OnlineCalibrator::restore(const RigCalibration& rig) noexcept {
  set_state(CalibrationTrigger::contradicted);
  rig_ = rig;
  keep();
}

void OnlineCalibrator::map_rebuilt(const odometry::Odometry& odometry) noexcept {
  monitor_.map_rebuilt(odometry.map(), rig_, verified() && solved_from_images());
}

void OnlineCalibrator::clear_frames() noexcept {
  discard_solve();
  frames_.clear();
  monitor_.reset();
}

void OnlineCalibrator::map_lost() noexcept {
  clear_prior();
  clear_frames();
  monitor_.map_lost();
}

void OnlineCalibrator::start_estimation(std::optional<CalibrationCause> cause, std::uint64_t onset,
                                        std::uint64_t now) noexcept {
  search_ = {.cause = cause.value_or(search_.cause), .onset = onset, .since = now};
  set_state(CalibrationTrigger::suspected);
  gate_ = Gate::open;
  discard_solve();
  frames_.begin_segment(onset);
  monitor_.begin_unlinked(rig_);
}

Reason OnlineCalibrator::missing() const noexcept {
  if (!estimating()) return Reason::none;
  if (frames_.standing() || gate_ == Gate::needs_motion) return Reason::needs_motion;
  return gate_ == Gate::needs_near_structure ? Reason::needs_near_structure : Reason::none;
}

void OnlineCalibrator::start_solve() noexcept {
  frames_.solve_begun();
  const calibration::TrackLog& log = frames_.log();
  solver_.log().copy(log);
  // The prior of the intrinsics is the initial calibration, not earlier results of these frames, so
  // that no measurement counts twice.
  request_ = {.rig = rig_, .from_rig = !estimating(), .given = &given_};
  if (refined_) {
    prior_ = *refined_;
    request_.known = &prior_;
    // The age of a supplied calibration is unknown, and its sigmas include it.
    const Stamp newest = log.frame(log.size() - 1).stamp,
                found = prior_.found == Stamp{} ? newest : prior_.found;
    if (estimating())
      calibration::assume_transforms(calibration::kUnknownTransform, &prior_);
    else
      calibration::let_drift((newest - found).to_seconds() / 3600.0, options_.calibration, &prior_);
  }
  solving_ = true;
  discarded_ = false;
  frames_since_start_ = 0;
  next_decision_ = std::min(kMinForMean, options_.calibration.adopt_after);
  runner_.start(TaskRef(task_));
}

void OnlineCalibrator::run_solve() noexcept {
  solved_ = solver_.solve(request_);
  solved_focal_ = {};
  if (options_.calibration.intrinsics != calibration::IntrinsicsEstimation::full || focal_known_ ||
      solved_.status != RigSolveStatus::ok)
    return;
  const calibration::RigSolution found = solver_.free_focal_lengths(request_);
  solved_focal_ = calibration::check_focal_length(found, given_);
  solved_.solve_ms += found.solve_ms;
}

bool OnlineCalibrator::start_last_solve() noexcept {
  const bool more = estimating() || frames_.new_since_solve();
  if (solving_ || !more || !frames_.enough_for_any()) return false;
  start_solve();
  return true;
}

Gate OnlineCalibrator::gate() const noexcept {
  return calibration::check_acceptance(
      {.solution = &solved_,
       .nominal = &nominal_,
       .in_use = calibrated() ? &rig_ : nullptr,
       .source = source_,
       .log = &frames_.log(),
       .pixel_sigma = options_.odometry.pixel_sigma,
       .may_have_changed = !(estimating() && search_.frames_before_change_dropped),
       .must_be_better = !request_.from_rig},
      options_.calibration);
}

calibration::Assessment OnlineCalibrator::assess(
    const RigCalibration& current, calibration::CalibrationOrigin source) const noexcept {
  return calibration::assess(solved_.rig, current, source, frames_.log(), solved_.newest,
                             options_.calibration, options_.odometry.pixel_sigma);
}

std::optional<CalibrationDecision> OnlineCalibrator::decide(Stamp stamp,
                                                            std::uint64_t number) noexcept {
  waited_ms_ = 0;
  if (!solving_ || ++frames_since_start_ < next_decision_) return std::nullopt;
  if (options_.adoption == Adoption::after_fixed_frames) {
    const auto begin = std::chrono::steady_clock::now();
    runner_.wait();
    waited_ms_ =
        std::chrono::duration<float, std::milli>(std::chrono::steady_clock::now() - begin).count();
  } else if (runner_.busy()) {
    return std::nullopt;
  }
  if (!outdated()) {
    // The decision waits for enough held-out frames; a failed solution needs none. At standstill
    // none are logged.
    if (solved_.status == RigSolveStatus::ok &&
        !calibration::held_out_enough(frames_.log(), solved_.newest))
      return std::nullopt;
    // An estimate is adopted as soon as the frames after its snapshot confirm it, and rejected only
    // when more of them would not help. A refinement waits only for its held-out frames.
    const int adopt_after = options_.calibration.adopt_after;
    if (!request_.from_rig && frames_since_start_ < adopt_after && gate() != Gate::open) {
      next_decision_ = std::min(next_decision_ + kMinForMean, adopt_after);
      return std::nullopt;
    }
  }
  return evaluate(stamp, number, false);
}

std::optional<CalibrationDecision> OnlineCalibrator::decide_now(Stamp stamp,
                                                                std::uint64_t number) noexcept {
  if (!solving_) return std::nullopt;
  runner_.wait();
  return evaluate(stamp, number, true);
}

std::optional<CalibrationDecision> OnlineCalibrator::evaluate(Stamp stamp, std::uint64_t number,
                                                              bool last) noexcept {
  solving_ = false;
  if (outdated()) return std::nullopt;
  gate_ = gate();
  // Frames of two rigs or out of sync cannot measure a focal length.
  if (gate_ != Gate::rig_changed && gate_ != Gate::out_of_sync && solved_focal_.measured_px > 0) {
    focal_ = solved_focal_;
    focal_known_ = frames_.solved_frames() >= frames_.max_frames() && !focal_.doubted;
  }
  CalibrationDecision d;
  d.stamp = stamp;
  d.calibration = solved_.rig;
  d.is_refinement = request_.from_rig;
  d.latency_frames = static_cast<int>(number - search_.since);
  d.onset_frame = search_.onset;
  d.held_out_after_px = calibration::held_out(frames_.log(), solved_.newest, solved_.rig).median_px;
  if (calibrated())
    d.held_out_before_px = calibration::held_out(frames_.log(), solved_.newest, rig_).median_px;
  d.focal = focal_;
  d.solve_ms = solved_.solve_ms;
  // One knock changes the rig in one solve only.
  const bool changed = solved_.changed_at > 0;
  d.not_rigid = std::exchange(search_.changed_in_solve, changed) && changed;
  d.offset_frames = solved_.offset_frames;
  if (d.is_refinement)
    evaluate_refinement(last, &d);
  else
    evaluate_estimate(&d);
  return d;
}

void OnlineCalibrator::evaluate_estimate(CalibrationDecision* d) noexcept {
  d->cause = search_.cause;
  d->accepted = gate_ == Gate::open;
  d->reason = calibration::reason(gate_);
  if (solved_.status == RigSolveStatus::ok) {
    // The depth errors are computed with the solution as the calibration in use.
    const calibration::Assessment then =
        assess(solved_.rig, calibration::CalibrationOrigin::this_drive);
    d->reference_depth_m = then.depth_m;
    d->depth_sigma_percent = then.sigma_percent;
    // An error of the focal length scales all distances.
    d->verified = then.verified && !d->focal.doubted;
    if (calibrated()) d->depth_error_percent = assess(rig_, source_).difference_percent;
  }
  if (!d->accepted) plan_search();
}

void OnlineCalibrator::plan_search() noexcept {
  const calibration::RigSolution& found = solved_;
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
  const CalibrationState before = state_;
  set_state(what);
  if (state_ == before) return;
  monitor_.watch(rig_, verified() && solved_from_images());
  // A verified supplied calibration keeps its intrinsics, whose errors vary over the image.
  if (verified() && !solved_from_images())
    monitor_.expect_scatter(std::max(options_.monitor.verified_bias_px, misfit_px));
}

void OnlineCalibrator::evaluate_refinement(bool last, CalibrationDecision* d) noexcept {
  d->cause = CalibrationCause::refinement;
  if (solved_.status == RigSolveStatus::ok) {
    const calibration::Assessment a = assess(rig_, source_);
    d->reference_depth_m = a.depth_m;
    d->depth_sigma_percent = a.sigma_percent;
    d->depth_error_percent = a.difference_percent;
    d->evidence = a.evidence;
    d->certainty = a.certainty;
    if (a.contradicted) d->cause = CalibrationCause::contradicted;
    // At the end no held-out frames are left; the solution of more frames is better.
    const calibration::TrackLog& log = frames_.log();
    const bool better = last && log.frame(log.size() - 1).number == solved_.newest
                            ? source_ == calibration::CalibrationOrigin::this_drive
                            : a.better;
    if (gate_ == Gate::open && !better && !(a.contradicted && !a.worse)) gate_ = Gate::no_better;
    // A verified calibration is not replaced by one that would not be.
    const bool certain = a.sigma_percent <= options_.calibration.max_depth_error_percent;
    if (gate_ == Gate::open && verified() && !certain && !a.contradicted) gate_ = Gate::no_better;
    // Frames that contradict earlier measurements verify nothing.
    d->verified = gate_ == Gate::open
                      ? certain
                      : a.verified && a.sigma_percent > 0 && calibration::of_this_rig(gate_);
    d->verified = d->verified && !d->focal.doubted;
    if (d->verified)
      apply_assessment(CalibrationTrigger::verified, misfit_px(*d));
    else if (a.contradicted || d->focal.contradicted)
      apply_assessment(CalibrationTrigger::contradicted, misfit_px(*d));
  }
  d->accepted = gate_ == Gate::open;
  d->reason = calibration::reason(gate_);
  if (d->accepted && d->cause == CalibrationCause::contradicted) clear_prior();
  plan_refinement();
}

/// Closes a full segment, whose result is the prior of the next one. A segment that later frames
/// contradict is closed as well, because its frames are of another rig.
void OnlineCalibrator::plan_refinement() noexcept {
  const calibration::RigSolution& found = solved_;
  const bool usable = gate_ == Gate::open || gate_ == Gate::no_better;
  if (gate_ == Gate::does_not_fit) {
    frames_.begin_segment(found.newest + 1);
  } else if (gate_ == Gate::rig_changed) {
    frames_.begin_segment(found.changed_at);
  } else if (frames_.solved_frames() >= frames_.max_frames()) {
    if (usable) refined_ = found.rig;
    frames_.begin_segment(found.newest + 1);
    frames_.require(frames_.max_frames());
  } else {
    // Sigmas fall with the root of the number of frames.
    frames_.require(2 * frames_.solved_frames());
  }
}

}  // namespace vergence
