#include "core/estimator/detail/estimator_parts.hpp"

#include <cmath>

/// States and the status of poses.
namespace vergence {
namespace {

constexpr int kLostAfter = 3;  // frames without a pose in a row before the state says so
// Frames with good images that no scene can be made of with the calibration in use.
constexpr int kUnmatchedAfter = 15;
// Frames after an image that came twice that would show that camera an exposure behind from then
// on, before it is believed not to be: the monitor needs nine.
constexpr int kLagShownAfter = 12;

Covariance6 upper_triangle(const Mat6& C) noexcept {
  Covariance6 out;
  auto next = out.begin();
  for (int i = 0; i < 6; ++i)
    for (int j = i; j < 6; ++j) *next++ = static_cast<float>(C(i, j));
  return out;
}

}  // namespace

/// States that follow from whether there is a pose.
void Estimator::Parts::follow(const odometry::FrameOutcome& out, const RigFrame& frame) noexcept {
  // Once a gap: covered cameras give frame after frame that lies behind it.
  if (out.gap_s > 0 && !in_gap)
    note(EstimatorEvent::Kind::time_gap, frame.stamp,
         "no frame for longer than motion can be predicted", out.gap_s);
  in_gap = out.gap_s > 0 && !out.posed;
  // Images of two instants match by no calibration: cameras out of step say nothing against it.
  const bool unmatched = !out.posed && out.images_good && out_of_step == 0 &&
                         out.reason == Reason::no_stereo_matches &&
                         odometry.linked() == odometry::Link::linked;
  unmatched_frames = unmatched ? unmatched_frames + 1 : 0;
  if (options.online && unmatched_frames == kUnmatchedAfter) {
    unmatched_frames = 0;
    give_up_calibration(frame, kUnmatchedAfter);
    odometry.reset_extrinsics();
  }
  if (out.uneven) {
    may_lag = kLagShownAfter;
    // Frames from before and frames out of step would be one solve, and a rig that is neither's.
    if (calibrator.seeking()) seek_anew(std::nullopt, frame.number, frame);
  }
  moves = out.posed && !odometry::may_be_none(drift.motion_to(out.T_left_world), motion_of(out));
  shows_no_lag = moves && !options.online;  // where there is no monitor, as far as anything does
  if (!out.posed) {
    if (++without_pose == kLostAfter) {
      transition(Trigger::pose_lost, frame.stamp);
      calibrator.scene_lost();
      verified = calibrator.verified();
    }
    return;
  }
  without_pose = 0;
  if (out.resumed && calibrator.seeking()) {
    calibrator.keep();
    note(EstimatorEvent::Kind::calibration_resumed, frame.stamp,
         "the calibration from before fits the images again", 0);
  }
  if (state == State::lost)
    transition(odometry.linked() == odometry::Link::linked ? Trigger::pose_found
               : !calibrator.calibrated()                  ? Trigger::pose_found_uncalibrated
               : calibrator.seeking()                      ? Trigger::pose_found_doubtful
                                      : Trigger::pose_found,  // found, and linked with this frame
               frame.stamp);
  if (state == State::initialising) {
    transition(Trigger::pair_found, frame.stamp);
    calibrator.seek(CalibrationCause::from_scratch, 0, frame.number);
  }
  if (out.restarted) {
    note(EstimatorEvent::Kind::scene_restarted, frame.stamp,
         "the map was rebuilt; the motion since the last pose is extrapolated", out.gap_s);
    calibrator.scene_lost();
    verified = calibrator.verified();
  }
  if (out.relocalised)
    note(EstimatorEvent::Kind::relocalised, frame.stamp, "found again among the window's points",
         0);
}

/// A rig that stands, or creeps, looks the same with a camera an exposure behind: such frames say
/// nothing about it.
void Estimator::Parts::settle_lag(const odometry::FrameOutcome& out) noexcept {
  if (may_lag > 0 && shows_no_lag && !out.uneven) --may_lag;
}

/// Covariance of the motion since the last pose.
Mat6 Estimator::Parts::motion_of(const odometry::FrameOutcome& out) const noexcept {
  return odometry::motion_covariance(out.fit_covariance, out.expected, out.unseen_s);
}

/// The frame's pose, how uncertain it is by now, and its status by how uncertain its motion is.
void Estimator::Parts::propagate(const odometry::FrameOutcome& out, PoseSample* sample) noexcept {
  sample->T_world_left = out.T_left_world.inverse();
  const double length_sigma = 0.01 * length_sigma_percent;
  const Mat6 motion = motion_of(out);
  grade_motion(out, motion, drift.motion_to(out.T_left_world).t.norm(), sample);
  const Mat6 told = motion + odometry::correction_covariance(out.corrected);
  drift.step(out.T_left_world, told, length_sigma, out.keyframe);
  sample->covariance = upper_triangle(drift.pose());
  sample->motion_covariance = upper_triangle(told);
  sample->corrected_m = static_cast<float>(out.corrected.t.norm());
  sample->length_sigma = static_cast<float>(length_sigma);
}

/// Against the drive's other motions and what the window made of it, where nothing else is known to
/// be wrong.
void Estimator::Parts::grade_motion(const odometry::FrameOutcome& out, const Mat6& motion,
                                    double step_m, PoseSample* sample) noexcept {
  const bool doubted = out_of_step > 0 || may_lag > 0 || undecided || state == State::recalibrating;
  const double sigma_m = std::sqrt(motion.topLeftCorner<3, 3>().trace());
  if (out.status != PoseStatus::ok || doubted) return;
  const WindowCorrection correction{out.corrected.t.norm(), step_m, sigma_m};
  const bool unusual = usual.judges(step_m, sigma_m) && usual.unusual(sigma_m);
  if (!unusual && !correction.spoils_motion()) return;
  if (sample->status != PoseStatus::ok) return;
  sample->status = PoseStatus::degraded;
  sample->reason = Reason::weak_geometry;
}

/// What the state of the calibration makes of a pose's status.
void Estimator::Parts::grade(const odometry::FrameOutcome& out, Pairing pairing,
                             PoseSample* sample) const noexcept {
  sample->status = out.posed ? out.status : PoseStatus::lost;
  sample->reason = out.reason;
  if (!out.posed) return;
  if (pairing == Pairing::contradicted && sample->status != PoseStatus::lost) {
    sample->status = PoseStatus::degraded;
    sample->reason = Reason::unproven_pairing;
  } else if (sample->status == PoseStatus::ok && out_of_step > 0) {
    sample->status = PoseStatus::degraded;
    sample->reason = Reason::out_of_step;
  } else if (sample->status == PoseStatus::ok && may_lag > 0 && moves) {
    // Of a pose that stands there is nothing to be wrong by an exposure.
    sample->status = PoseStatus::degraded;
    sample->reason = Reason::image_repeated;
  } else if (sample->status == PoseStatus::ok && (undecided || state == State::recalibrating)) {
    sample->status = PoseStatus::degraded;
    sample->reason = Reason::recalibrating;
  } else if (options.online && (superseded || !calibrator.verified()) &&
             (sample->status == PoseStatus::ok || (sample->reason == Reason::moving_scene &&
                                                   odometry.linked() == odometry::Link::linked))) {
    // Points are lost by a calibration that does not fit as they are by what moves.
    sample->status = PoseStatus::degraded;
    sample->reason = unconfirmed ? Reason::unconfirmed : Reason::unverified_calibration;
  } else if (out.reason == Reason::uncalibrated) {
    sample->reason = why_uncalibrated();
  }
}

/// What was wrong in the frames before makes of the status of one about which nothing is.
void Estimator::Parts::grade_window(const odometry::FrameOutcome& out,
                                    PoseSample* sample) noexcept {
  if (!out.posed) return;
  if (out.relinked || out.restarted) return window_doubt.clear();
  if (out.gap_s > 0 || out.renewed) return window_doubt.add(Reason::time_gap, WindowDoubt::kWindow);
  if (undecided || state == State::recalibrating) return window_doubt.add(Reason::recalibrating, 1);
  const Reason why = window_doubt.next();
  if (why == Reason::none || sample->status != PoseStatus::ok) return;
  sample->status = PoseStatus::degraded;
  sample->reason = why;
}

/// What a pose of cameras that are not linked says of its calibration: the most particular that is
/// known.
Reason Estimator::Parts::why_uncalibrated() const noexcept {
  if (calibrator.last_gate() == calibration::Gate::cameras_swapped) return Reason::cameras_swapped;
  if (out_of_step > 0) return Reason::out_of_step;
  if (calibrator.missing() != Reason::none) return calibrator.missing();
  return state == State::parallel_monocular || state == State::calibrating ? Reason::uncalibrated
                                                                           : Reason::recalibrating;
}

}  // namespace vergence
