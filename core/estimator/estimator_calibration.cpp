#include <algorithm>
#include <cmath>
#include <utility>

#include "core/estimator/detail/estimator_parts.hpp"

/// The estimator's handling of the rig's calibration, frame by frame.
namespace vergence {
namespace {

/// Number of the first frame whose tracks describe the present rig. `fewest`: frames of a solve.
std::uint64_t first_usable_frame(const RigAssessment& v, std::uint64_t now, int fewest) noexcept {
  using K = calibration::MonitorResult::Kind;
  // Until now there were only wrong matches.
  if (v.kind == K::collapse) return now;
  // Only the newest frames describe a drifting rig.
  if (v.kind == K::drift)
    return std::max(v.onset_frame, now - std::min(now, static_cast<std::uint64_t>(fewest)));
  return v.onset_frame;
}

CalibrationCause to_cause(calibration::MonitorResult::Kind kind) noexcept {
  using K = calibration::MonitorResult::Kind;
  if (kind == K::drift) return CalibrationCause::drift;
  return kind == K::collapse ? CalibrationCause::collapse : CalibrationCause::knock;
}

const char* cause_message(CalibrationCause cause) noexcept {
  switch (cause) {
    case CalibrationCause::from_scratch:
      return "no calibration";
    case CalibrationCause::knock:
      return "the rig has changed: a camera was knocked";
    case CalibrationCause::drift:
      return "the extrinsics are drifting";
    case CalibrationCause::collapse:
      return "left and right hardly match: a camera was knocked far off or is out of focus";
    case CalibrationCause::out_of_sync:
      return "the images of the cameras are from different instants";
    case CalibrationCause::requested:
      return "a recalibration was requested";
    case CalibrationCause::contradicted:
      return "left and right hardly match: the calibration in use does not fit the rig";
    case CalibrationCause::refinement:
      break;
  }
  return "";
}

}  // namespace

/// Starts estimating another calibration, because the rig has or may have changed at `onset`.
void Estimator::Parts::start_estimation(CalibrationCause cause, std::uint64_t onset,
                                        const RigFrame& frame) noexcept {
  transition(cause == CalibrationCause::requested ? Trigger::requested : Trigger::rig_changed,
             frame.stamp);
  calibrator.start_estimation(cause, onset, frame.number);
  degradations.enter(Degradation::rig, Reason::recalibrating, frame.number);
  degradations.enter(Degradation::calibration, Reason::unverified_calibration, frame.number);
  length_sigma_percent = kUnlinkedLengthPercent;
  odometry.unlink();
}

void Estimator::Parts::suspect_rig(CalibrationCause cause, std::uint64_t onset,
                                   const RigFrame& frame, const ChangeEvidence& evidence) noexcept {
  record(EstimatorEvent::Kind::rig_changed, frame.stamp, cause_message(cause),
         static_cast<double>(frame.number - std::min(onset, frame.number)), evidence);
  start_estimation(cause, onset, frame);
}

/// Handles frames in which left and right hardly match: a verified calibration indicates a large
/// knock, an unverified one was wrong from the start.
void Estimator::Parts::give_up_calibration(const RigFrame& frame, double frames) noexcept {
  const CalibrationCause cause =
      calibrator.verified() ? CalibrationCause::collapse : CalibrationCause::contradicted;
  if (cause == CalibrationCause::collapse)
    record(EstimatorEvent::Kind::rig_changed, frame.stamp, cause_message(cause), frames);
  else
    record(EstimatorEvent::Kind::calibration_contradicted, frame.stamp, cause_message(cause), 0);
  start_estimation(cause, frame.number, frame);
  // The previous extrinsics are not a starting point: on repetitive structure, matches near them
  // are chance.
  odometry.reset_extrinsics();
}

void Estimator::Parts::record_out_of_sync(Stamp stamp, double lag_frames) noexcept {
  if (!degradations.active(Degradation::out_of_sync))
    record(EstimatorEvent::Kind::out_of_sync, stamp, cause_message(CalibrationCause::out_of_sync),
           lag_frames);
  degradations.enter(Degradation::out_of_sync, Reason::out_of_sync, last_number, 1);
  calibrator.monitor().question_pairing();
  // Frames out of sync would indicate a lag in the monitor's windows long after its end, and must
  // not enter a calibration.
  calibrator.clear_frames();
}

/// Acts on the monitors' assessment of a frame posed with the calibration in use: knock, drift,
/// collapse or lag.
void Estimator::Parts::watch(const odometry::FrameOutcome& out, const RigFrame& frame) noexcept {
  using K = calibration::MonitorResult::Kind;
  const RigAssessment v =
      calibrator.monitor().update(odometry, out, frame.number, moves, calibrator.verified());
  margins = v.margins;
  degradations.set(Degradation::rig, v.undecided, Reason::recalibrating, frame.number);
  if (v.lag_frames != 0) {
    record_out_of_sync(frame.stamp, v.lag_frames);
    return;
  }
  if (v.cameras_in_sync) {
    degradations.clear(Degradation::late_image);
    if (degradations.weaken(Degradation::out_of_sync)) {
      record(EstimatorEvent::Kind::cameras_in_sync, frame.stamp, "the cameras are in sync again",
             0);
      calibrator.clear_frames();
    }
  }
  // Cameras out of sync fit no calibration: other results of the monitor are ignored meanwhile.
  if (degradations.active(Degradation::out_of_sync)) return;
  if (v.kind == K::collapse) {
    give_up_calibration(frame,
                        static_cast<double>(frame.number - std::min(v.onset_frame, frame.number)));
  } else if (v.kind != K::quiet) {
    suspect_rig(to_cause(v.kind),
                first_usable_frame(v, frame.number, options.calibration.min_frames), frame,
                v.evidence);
  }
}

/// Detects a change of the rig during an estimation. Frames before and after the change must not
/// enter one solve, nor may later frames confirm a solution from earlier ones.
void Estimator::Parts::watch_estimate(const odometry::FrameOutcome& out,
                                      const RigFrame& frame) noexcept {
  const auto onset = calibrator.monitor().update_unlinked(odometry, out, frame.number);
  if (!onset) return;
  if (!calibrator.estimating()) return suspect_rig(CalibrationCause::knock, *onset, frame);
  record(EstimatorEvent::Kind::rig_changed, frame.stamp,
         "a camera was knocked during the calibration", static_cast<double>(frame.number - *onset));
  restart_estimation(
      calibrator.calibrated() ? CalibrationCause::knock : CalibrationCause::from_scratch, *onset,
      frame);
}

/// Restarts the estimation because its frames are of another rig. Without a cause, the estimation
/// keeps its own.
void Estimator::Parts::restart_estimation(std::optional<CalibrationCause> cause,
                                          std::uint64_t onset, const RigFrame& frame) noexcept {
  calibrator.start_estimation(cause, onset, frame.number);
  if (state == State::calibrating) transition(Trigger::calibration_rejected, frame.stamp);
}

/// Starts solves and acts on their decisions.
void Estimator::Parts::calibrate(const RigFrame& frame) noexcept {
  if (const auto decision = calibrator.decide(frame.stamp, frame.number))
    apply(*decision, frame.stamp);
  const bool solves = state == State::parallel_monocular || state == State::recalibrating ||
                      state == State::stereo_odometry;
  if (solves && calibrator.can_solve()) {
    calibrator.start_solve();
    if (calibrator.estimating()) transition(Trigger::frames_enough, frame.stamp);
  }
  notify_missing(frame.stamp);
}

/// Updates the relative sigma of lengths: an adopted calibration's own sigma; for one that stays,
/// combined with its difference from the online estimate.
void Estimator::Parts::record_length_sigma(const CalibrationDecision& decision) noexcept {
  if (!(decision.depth_sigma_percent > 0)) return;
  if (decision.accepted)
    length_sigma_percent = decision.depth_sigma_percent;
  else if (odometry.linked() == odometry::Link::linked && calibrator.verified())
    length_sigma_percent = std::hypot(decision.depth_sigma_percent, decision.depth_error_percent);
}

/// Adopts a calibration. Poses depend on it once the map is rebuilt with it; until then the status
/// of the previous one applies.
void Estimator::Parts::adopt(const CalibrationDecision& decision) noexcept {
  degradations.clear(Degradation::rig);
  verified_percent = decision.depth_sigma_percent;
  verified_by = {};
  degradations.enter(Degradation::calibration, Reason::unverified_calibration, last_number,
                     decision.verified ? 1 : DegradationLedger::kUntilCleared);
  odometry.link(decision.calibration);
}

/// Acts on the decision of a refinement.
void Estimator::Parts::apply_refinement(const CalibrationDecision& decision, Stamp stamp) noexcept {
  if (calibrator.last_gate() == calibration::Gate::out_of_sync) return record_out_of_sync(stamp, 0);
  const bool was_suspect = degradations.active(Degradation::calibration),
             contradicted = decision.cause == CalibrationCause::contradicted;
  if (contradicted && was_suspect)
    record(EstimatorEvent::Kind::calibration_contradicted, stamp,
           "the calibration in use does not fit the rig", decision.depth_error_percent,
           decision.evidence);
  if (decision.accepted) {
    record(EstimatorEvent::Kind::calibration_accepted, stamp, "a better calibration is adopted",
           decision.calibration.frames,
           {0, decision.evidence.shift_px, decision.evidence.rotation_mrad});
    calibrator.adopt_refinement(decision.calibration);
    adopt(decision);
  }
  if (decision.verified && !contradicted) {
    // The calibration before the refinement is verified as well.
    degradations.clear(Degradation::calibration);
    verified_percent = decision.depth_sigma_percent;
    if (!decision.accepted) verified_by = decision.evidence;
    if (was_suspect) notify_verified(stamp);
  } else if (!calibrator.verified() && !degradations.active(Degradation::calibration)) {
    degradations.enter(Degradation::calibration, Reason::unverified_calibration, last_number);
  }
}

void Estimator::Parts::notify_verified(Stamp stamp) noexcept {
  not_rigid = false;
  record(EstimatorEvent::Kind::calibration_verified, stamp, "the calibration in use is verified",
         verified_percent, verified_by);
}

void Estimator::Parts::apply(const CalibrationDecision& decision, Stamp stamp) noexcept {
  (void)decisions.push(decision);
  if (decision.focal.contradicted && !std::exchange(focal_contradicted, true))
    record(EstimatorEvent::Kind::focal_length_contradicted, stamp,
           "the configured focal length does not fit the images", decision.focal.measured_px);
  focal_contradicted = decision.focal.contradicted;
  if (decision.not_rigid && !std::exchange(not_rigid, true))
    record(EstimatorEvent::Kind::rig_not_rigid, stamp,
           decision.offset_frames == 0
               ? "the extrinsics change all the time: a camera is loose"
               : "the images of the cameras are a fraction of a frame apart",
           decision.offset_frames);
  if (decision.is_refinement) {
    apply_refinement(decision, stamp);
    return record_length_sigma(decision);
  }
  record_length_sigma(decision);
  if (decision.accepted) {
    record(EstimatorEvent::Kind::calibration_accepted, stamp, "a calibration is accepted",
           decision.calibration.frames);
    calibrator.adopt(decision);
    adopt(decision);
    transition(Trigger::calibration_accepted, stamp);
    return;
  }
  record(EstimatorEvent::Kind::calibration_rejected, stamp, decision.reason,
         decision.calibration.frames);
  switch (calibrator.last_gate()) {
    case calibration::Gate::no_better:
      calibrator.keep();
      degradations.clear(Degradation::rig);
      odometry.link(calibrator.in_use());
      transition(Trigger::calibration_kept, stamp);
      break;
    case calibration::Gate::out_of_sync:
      degradations.enter(Degradation::out_of_sync, Reason::out_of_sync, last_number, 1);
      calibrator.monitor().question_pairing();
      [[fallthrough]];
    default:
      transition(Trigger::calibration_rejected, stamp);
  }
}

void Estimator::Parts::notify_missing(Stamp stamp) noexcept {
  const Reason missing = calibrator.missing();
  if (missing == notified_missing) return;
  notified_missing = missing;
  if (missing == Reason::needs_motion)
    record(EstimatorEvent::Kind::calibration_pending, stamp,
           "the rig must move before it can be calibrated", 0);
  else if (missing == Reason::needs_near_structure)
    record(EstimatorEvent::Kind::calibration_pending, stamp,
           "near objects must be visible before the rig can be calibrated", 0);
}

}  // namespace vergence
