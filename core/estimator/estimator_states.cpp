#include "core/estimator/detail/estimator_parts.hpp"

#include <algorithm>
#include <cmath>

/// States and the status of poses.
namespace vergence {
namespace {

// Number of frames in a window at speed, where each is a keyframe (the default of
// odometry.window_keyframes). Whatever disturbs a frame is in the window for that long. A rebuilt
// map and a dynamic scene are marked for as many frames, because a passing vehicle looks static in
// single ones; a calibration with which so many good images in a row do not match is given up; and
// a camera that repeated an image counts as in sync after as many moving frames, if the rig is not
// monitored.
constexpr int kWindowFrames = 10;

Covariance6 upper_triangle(const Mat6& C) noexcept {
  Covariance6 out;
  auto next = out.begin();
  for (int i = 0; i < 6; ++i)
    for (int j = i; j < 6; ++j) *next++ = static_cast<float>(C(i, j));
  return out;
}

}  // namespace

/// Updates the state from whether there is a pose.
void Estimator::Parts::follow(const odometry::FrameOutcome& out, const RigFrame& frame) noexcept {
  // Report a gap once: with covered cameras every frame lies behind it.
  if (out.gap_s > 0 && !in_gap)
    record(EstimatorEvent::Kind::time_gap, frame.stamp,
           "no frame for longer than motion can be predicted", out.gap_s);
  in_gap = out.gap_s > 0 && !out.posed;
  // Images of different instants match with no calibration, so they are no evidence against it.
  const bool unmatched =
      !out.posed && out.images_good && !degradations.active(Degradation::out_of_sync) &&
      !degradations.active(Degradation::late_image) && out.reason == Reason::no_stereo_matches &&
      odometry.linked() == odometry::Link::linked;
  unmatched_frames = unmatched ? unmatched_frames + 1 : 0;
  if (options.online && unmatched_frames == kWindowFrames) {
    unmatched_frames = 0;
    give_up_calibration(frame, kWindowFrames);
  }
  if (out.uneven) {
    degradations.enter(Degradation::late_image, Reason::image_repeated, frame.number,
                       kWindowFrames);
    calibrator.monitor().question_pairing();
    // A solve must not mix frames from before with frames that may be out of sync.
    if (calibrator.estimating()) restart_estimation(std::nullopt, frame.number, frame);
  }
  moves = out.posed &&
          !odometry::may_be_none(drift.motion_to(out.T_left_world), motion_covariance(out));
  if (!out.posed) {
    if (++without_pose == odometry::kMissesAllowed + 1) {
      transition(Trigger::pose_lost, frame.stamp);
      mark_calibration_unverified(frame.number);
    }
    return;
  }
  without_pose = 0;
  if (out.resumed) {
    calibrator.restore(odometry.rig());
    degradations.clear(Degradation::rig);
    record(EstimatorEvent::Kind::calibration_resumed, frame.stamp,
           "the previous calibration fits the images again", 0);
  }
  if (state == State::lost)
    transition(odometry.linked() == odometry::Link::linked ? Trigger::pose_found
               : !calibrator.calibrated()                  ? Trigger::pose_found_uncalibrated
               : calibrator.estimating()                   ? Trigger::pose_found_suspect
                                                           : Trigger::pose_found,
               frame.stamp);
  if (state == State::initialising) {
    transition(Trigger::pair_found, frame.stamp);
    calibrator.start_estimation(CalibrationCause::from_scratch, 0, frame.number);
  }
  if (out.restarted) {
    record(EstimatorEvent::Kind::map_reset, frame.stamp,
           "the map was rebuilt; the motion since the last pose is extrapolated", out.gap_s);
    // The speed and the points of the new map have another usual uncertainty.
    covariance_baseline = {};
    mark_calibration_unverified(frame.number);
  }
  if (out.relocalised)
    record(EstimatorEvent::Kind::relocalised, frame.stamp,
           "relocalised against the points of the window", 0);
}

/// Marks the calibration as unverified, because the rig was not monitored during the missed frames.
void Estimator::Parts::mark_calibration_unverified(std::uint64_t number) noexcept {
  calibrator.map_lost();
  if (options.online && !degradations.active(Degradation::calibration))
    degradations.enter(Degradation::calibration, Reason::unverified_calibration, number);
}

/// Covariance of the motion since the last pose.
Mat6 Estimator::Parts::motion_covariance(const odometry::FrameOutcome& out) const noexcept {
  return odometry::motion_covariance(out.fit_covariance, out.expected, out.unseen_s);
}

/// Fills in the frame's pose and covariances.
void Estimator::Parts::propagate(const odometry::FrameOutcome& out, PoseSample* sample) noexcept {
  sample->T_world_left = out.T_left_world.inverse();
  const double length_sigma = 0.01 * length_sigma_percent;
  const Mat6 motion = motion_covariance(out);
  check_motion(motion, drift.motion_to(out.T_left_world).t.norm());
  const Mat6 reported = motion + odometry::correction_covariance(out.corrected);
  drift.step(out.T_left_world, reported, length_sigma, out.keyframe);
  sample->covariance = upper_triangle(drift.pose());
  sample->motion_covariance = upper_triangle(reported);
  sample->length_sigma = static_cast<float>(length_sigma);
}

/// Checks the motion against the usual uncertainty, unless a stronger degradation explains it.
/// Errors of an unusually uncertain motion stay in the window.
void Estimator::Parts::check_motion(const Mat6& motion, double step_m) noexcept {
  if (degradations.any_up_to(Degradation::rig) || degradations.active(Degradation::dynamic_scene))
    return;
  const double sigma_m = std::sqrt(motion.topLeftCorner<3, 3>().trace());
  if (!covariance_baseline.measurable(step_m, sigma_m)) return;
  if (covariance_baseline.update(sigma_m))
    degradations.enter(Degradation::window, Reason::weak_geometry, last_number, kWindowFrames + 1);
  margins.uncertainty = covariance_baseline.margin();
}

/// Enters the degradations that a posed frame causes.
void Estimator::Parts::update_degradations(const odometry::FrameOutcome& out,
                                           Pairing pairing) noexcept {
  degradations.set(Degradation::pairing, pairing == Pairing::contradicted,
                   Reason::pairing_ambiguous, last_number);
  if (out.restarted)
    degradations.enter(Degradation::scene, Reason::map_reset, last_number, kWindowFrames + 1);
  degradations.set(Degradation::frame, out.status != PoseStatus::ok,
                   out.reason == Reason::uncalibrated ? why_uncalibrated() : out.reason,
                   last_number);
  if (state == State::recalibrating)
    degradations.enter(Degradation::rig, Reason::recalibrating, last_number);
  if (out.moving && !degradations.any_up_to(Degradation::rig))
    degradations.enter(Degradation::dynamic_scene, Reason::dynamic_scene, last_number,
                       kWindowFrames);
  // Errors of degraded frames stay in the window's keyframes and points, and correcting them
  // disturbs later motions. So poses stay degraded for as many frames as were degraded, at most for
  // a window's length.
  if (out.relinked || out.restarted)
    degradations.clear(Degradation::window);
  else if (out.gap_s > 0 || out.map_rebuilt)
    degradations.enter(Degradation::window, Reason::time_gap, last_number, kWindowFrames + 1);
  else if ((out.keyframe || degradations.active(Degradation::window)) &&
           degradations.any_up_to(Degradation::rig))
    degradations.enter(Degradation::window, degradations.strongest(true)->reason, last_number,
                       std::min(degradations[Degradation::window].left + 2, kWindowFrames + 1));
}

/// Weakens or ends the degradations that a posed frame is evidence against.
void Estimator::Parts::weaken_degradations(const odometry::FrameOutcome& out,
                                           Stamp stamp) noexcept {
  for (const Degradation degradation :
       {Degradation::scene, Degradation::dynamic_scene, Degradation::window})
    (void)degradations.weaken(degradation);
  // At standstill, an image that is late by an exposure looks the same.
  if (moves && !out.uneven && !options.online) (void)degradations.weaken(Degradation::late_image);
  // The next pose depends on the adopted calibration.
  if (out.relinked && degradations.weaken(Degradation::calibration)) notify_verified(stamp);
}

/// The most specific known reason for poses of unlinked cameras.
Reason Estimator::Parts::why_uncalibrated() const noexcept {
  if (calibrator.last_gate() == calibration::Gate::cameras_swapped) return Reason::cameras_swapped;
  if (degradations.active(Degradation::out_of_sync)) return Reason::out_of_sync;
  if (calibrator.missing() != Reason::none) return calibrator.missing();
  return state == State::parallel_monocular || state == State::calibrating ? Reason::uncalibrated
                                                                           : Reason::recalibrating;
}

}  // namespace vergence
