#include "core/estimator/estimator.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <new>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

#include "core/estimator/degradations.hpp"
#include "core/estimator/detail/covariance_baseline.hpp"
#include "core/estimator/online_calibrator.hpp"
#include "core/estimator/states.hpp"
#include "core/memory/fixed_vector.hpp"
#include "core/odometry/drift_covariance.hpp"
#include "core/odometry/odometry.hpp"

namespace vergence {
namespace {

using Change = calibration::MonitorResult::Kind;

// Number of frames in a window at speed, where every frame is a keyframe (the default of
// odometry.window_keyframes). A disturbed frame stays in the window for this long. The same number
// is used for other durations: a rebuilt map and a dynamic scene degrade this many frames, because
// a passing vehicle looks static in single ones; a calibration is given up after this many
// consecutive good image pairs without stereo matches; and without monitoring, a camera that
// repeated an image counts as in sync after this many moving frames.
constexpr int kWindowFrames = 10;
// Relative uncertainty of lengths without a calibration, in percent. The baseline length then sets
// the scale and is assumed, not measured; such poses are degraded.
constexpr double kUnlinkedLengthPercent = 10;

/// Throws std::invalid_argument if the rig or the options cannot be used.
void check(const EstimatorOptions& options, const RigCalibration& rig) {
  const bool known = options.trust != CalibrationTrust::none;
  if (rig.cameras < 2 || rig.cameras > kMaxCameras)
    throw std::invalid_argument("a rig of 2 to " + std::to_string(kMaxCameras) +
                                " cameras is needed, this one has " + std::to_string(rig.cameras));
  for (int k = 0; k < rig.cameras; ++k) {
    const auto i = static_cast<std::size_t>(k);
    const Intrinsics& c = rig.intrinsics[i];
    const std::string camera = "camera " + std::to_string(k) + ": ";
    if (c.width < 64 || c.height < 64 || !(c.fx > 0) || !(c.fy > 0))
      throw std::invalid_argument(
          camera + "images of at least 64×64 pixels and positive focal lengths are needed");
    const ImageView& mask = options.masks[i];
    const auto pixels = [](int width, int height) {
      return std::to_string(width) + "×" + std::to_string(height);
    };
    if (!mask.empty() && (mask.width != c.width || mask.height != c.height))
      throw std::invalid_argument(camera + "its mask is " + pixels(mask.width, mask.height) +
                                  " pixels, its images are " + pixels(c.width, c.height));
    if (k > 0 && known && !(rig.T_camera_left[i].t.norm() > 1e-3))
      throw std::invalid_argument(camera +
                                  "its baseline is below a millimetre, no depth can be measured");
  }
  if (!known && !(rig.baseline > 1e-3))
    throw std::invalid_argument(
        "the length of the baseline is needed to calibrate from scratch: it sets the scale of "
        "everything");
}

/// Returns the frame, with only its first image if the pairing is contradicted.
RigFrame usable(const RigFrame& frame) noexcept {
  RigFrame usable = frame;
  if (frame.pairing != Pairing::contradicted) return usable;
  bool any = false;
  for (ImageView& image : usable.images) {
    if (any) image = {};
    any = any || !image.empty();
  }
  return usable;
}

/// Message of the event that reports this cause.
const char* message(CalibrationCause cause) noexcept {
  // In the order of CalibrationCause.
  static constexpr std::array kMessages = {
      "no calibration",
      "the rig has changed: a camera was knocked",
      "the extrinsics are drifting",
      "left and right hardly match: a camera was knocked far off or is out of focus",
      "the images of the cameras are from different instants",
      "a recalibration was requested",
      "",
      "left and right hardly match: the calibration in use does not fit the rig"};
  static_assert(kMessages.size() == static_cast<std::size_t>(CalibrationCause::contradicted) + 1);
  return kMessages[static_cast<std::size_t>(cause)];
}

Covariance6 upper_triangle(const Mat6& C) noexcept {
  Covariance6 out;
  auto next = out.begin();
  for (int i = 0; i < 6; ++i)
    for (int j = i; j < 6; ++j) *next++ = static_cast<float>(C(i, j));
  return out;
}

}  // namespace

struct Estimator::Parts {
  using Kind = EstimatorEvent::Kind;

  Parts(const EstimatorOptions& o, const RigCalibration& r, const RigCalibration& nominal,
        Arena& arena, PairRunner& runner, BackgroundRunner& solver)
      : options(o),
        odometry(options.odometry, r, o.trust != CalibrationTrust::none, arena, runner, o.masks),
        calibrator(options, r, nominal, arena, solver),
        length_sigma_percent(o.trust == CalibrationTrust::none
                                 ? kUnlinkedLengthPercent
                                 : o.calibration.max_depth_error_percent) {
    if (options.online)
      degradations.enter(Degradation::calibration, Reason::unverified_calibration);
  }

  PoseSample process(const RigFrame& given) noexcept {
    const auto start = std::chrono::steady_clock::now();
    const RigFrame frame = usable(given);
    events.clear();
    decisions.clear();
    margins = {};
    PoseSample sample;
    sample.frame = frame.number;
    sample.stamp = frame.stamp;
    sample.state = state;
    if (any && !(frame.stamp > last)) {
      sample.reason = Reason::time_gap;
      record(Kind::dropped, "the frame is not newer than the one before",
             (last - frame.stamp).to_seconds());
      events.back().stamp = frame.stamp;
      return sample;
    }
    any = true;
    last = frame.stamp;
    last_number = frame.number;
    if (state == State::initialising && calibrator.calibrated())
      transition(Trigger::calibration_given);
    // A request made while there is no pose waits until there is one.
    const bool can_be_asked = state != State::lost && state != State::initialising;
    if (can_be_asked && requested.exchange(false, std::memory_order_relaxed) &&
        state == State::stereo_odometry && options.online)
      suspect_rig(CalibrationCause::requested, last_number);

    odometry::FrameOutcome out = odometry.process(frame, options.frame_budget);
    follow(out);
    if (options.online && out.posed) {
      // watch() may unlink the cameras, from the next frame on.
      const bool was_linked = linked();
      if (was_linked && state == State::stereo_odometry && !out.restarted) watch(out);
      if (!was_linked && (calibrator.estimating() || calibrator.monitor().map_rebuild_pending()))
        watch_estimate(out);
      // Images that are out of sync cannot be used for calibration, even if no lag is visible for a
      // while.
      if (!degradations.active(Degradation::out_of_sync) || state != State::stereo_odometry)
        calibrator.frames().add(odometry, out, frame);
    }
    odometry.rebuild(&out);
    if (options.online) {
      if (out.relinked) {
        calibrator.map_rebuilt(odometry);
        if (out.relink_due)
          record(Kind::calibration_applied, "the map uses the accepted calibration",
                 100 * out.points_kept);
      }
      if (out.map_rebuilt) calibrator.monitor().map_rebuilt(odometry.map());
      calibrate();
    }
    sample.state = state;
    sample.reason = out.reason;
    if (out.posed) {
      update_degradations(out, frame.pairing);
      propagate(out, &sample);
      const DegradationLedger::Entry* why = degradations.strongest(moves);
      sample.status = why == nullptr ? PoseStatus::ok : PoseStatus::degraded;
      sample.reason = why == nullptr ? Reason::none : why->reason;
      weaken_degradations(out);
    }
    sample.inliers = out.inliers;
    sample.stereo_inliers = out.stereo_inliers;
    sample.reprojection_px = out.reprojection_px;
    sample.keyframe = out.keyframe;
    sample.effort = out.effort;
    sample.stage_ms = out.stage_ms;
    // Waiting for the solver makes replays deterministic; it is not part of the frame's processing
    // time.
    sample.estimate_ms =
        std::chrono::duration<float, std::milli>(std::chrono::steady_clock::now() - start).count() -
        calibrator.waited_ms();
    return sample;
  }

  void finish() noexcept {
    events.clear();
    decisions.clear();
    if (!options.online) return;
    // At most three solves: the running one, one with the frames logged since, and a refinement
    // with all frames.
    while (!decisions.full()) {
      if (!calibrator.solving()) {
        if (!calibrator.start_last_solve()) return;
        if (calibrator.estimating()) transition(Trigger::frames_enough);
      }
      if (const auto decision = calibrator.decide_now(last, last_number)) apply(*decision);
    }
  }

  void transition(Trigger trigger) noexcept {
    const auto* t = find_edge(kTransitions, state, trigger);
    if (t == nullptr) return;
    (void)events.push({Kind::state, last, t->from, t->to, t->why, 0, {}});
    state = t->to;
  }
  void record(Kind kind, const char* why, double value = 0,
              const ChangeEvidence& evidence = {}) noexcept {
    (void)events.push({kind, last, state, state, why, value, evidence});
  }
  [[nodiscard]] bool linked() const noexcept { return odometry.linked() == odometry::Link::linked; }
  /// Number of frames since frame number `onset`.
  [[nodiscard]] double frames_since(std::uint64_t onset) const noexcept {
    return static_cast<double>(last_number - std::min(onset, last_number));
  }

  /// Updates the state according to whether the frame has a pose.
  void follow(const odometry::FrameOutcome& out) noexcept {
    // Report a gap once: with covered cameras every frame lies behind it.
    if (out.gap_s > 0 && !in_gap)
      record(Kind::time_gap, "no frame for longer than motion can be predicted", out.gap_s);
    in_gap = out.gap_s > 0 && !out.posed;
    // Images of different instants match with no calibration, so they are no evidence against it.
    const bool unmatched = !out.posed && out.images_good &&
                           !degradations.active(Degradation::out_of_sync) &&
                           !degradations.active(Degradation::late_image) &&
                           out.reason == Reason::no_stereo_matches && linked();
    unmatched_frames = unmatched ? unmatched_frames + 1 : 0;
    if (options.online && unmatched_frames == kWindowFrames) {
      unmatched_frames = 0;
      give_up_calibration(kWindowFrames);
    }
    if (out.uneven) {
      degradations.enter(Degradation::late_image, Reason::image_repeated, kWindowFrames);
      calibrator.monitor().question_pairing();
      // A solve must not mix frames from before with frames that may be out of sync.
      if (calibrator.estimating()) restart_estimation(std::nullopt, last_number);
    }
    moves = out.posed &&
            !odometry::may_be_none(drift.motion_to(out.T_left_world), motion_covariance(out));
    if (!out.posed) {
      if (++without_pose == odometry::kMissesAllowed + 1) {
        transition(Trigger::pose_lost);
        mark_calibration_unverified();
      }
      return;
    }
    without_pose = 0;
    if (out.resumed) {
      calibrator.restore(odometry.rig());
      degradations.clear(Degradation::rig);
      record(Kind::calibration_resumed, "the previous calibration fits the images again");
    }
    if (state == State::lost)
      transition(linked()                   ? Trigger::pose_found
                 : !calibrator.calibrated() ? Trigger::pose_found_uncalibrated
                 : calibrator.estimating()  ? Trigger::pose_found_suspect
                                            : Trigger::pose_found);
    if (state == State::initialising) {
      transition(Trigger::pair_found);
      calibrator.start_estimation(CalibrationCause::from_scratch, 0, last_number);
    }
    if (out.restarted) {
      record(Kind::map_reset, "the map was rebuilt; the motion since the last pose is extrapolated",
             out.gap_s);
      // The speed and the points of the new map have another usual uncertainty.
      covariance_baseline = {};
      mark_calibration_unverified();
    }
    if (out.relocalised) record(Kind::relocalised, "relocalised against the points of the window");
  }

  /// Acts on the monitors' assessment of a frame posed with the calibration in use: knock, drift,
  /// collapse or lag.
  void watch(const odometry::FrameOutcome& out) noexcept {
    const RigAssessment v =
        calibrator.monitor().update(odometry, out, last_number, moves, calibrator.verified());
    margins = v.margins;
    degradations.set(Degradation::rig, v.undecided, Reason::recalibrating);
    if (v.lag_frames != 0) return record_out_of_sync(v.lag_frames);
    if (v.cameras_in_sync) {
      degradations.clear(Degradation::late_image);
      if (degradations.weaken(Degradation::out_of_sync)) {
        record(Kind::cameras_in_sync, "the cameras are in sync again");
        calibrator.clear_frames();
      }
    }
    // Cameras out of sync fit no calibration: other results of the monitor are ignored meanwhile.
    if (degradations.active(Degradation::out_of_sync)) return;
    if (v.change.kind == Change::collapse) {
      give_up_calibration(frames_since(v.change.onset_frame));
    } else if (v.change.kind == Change::drift) {
      // Only the newest frames describe a drifting rig.
      const auto newest = static_cast<std::uint64_t>(options.calibration.min_frames);
      suspect_rig(CalibrationCause::drift,
                  std::max(v.change.onset_frame, last_number - std::min(last_number, newest)),
                  v.change.evidence);
    } else if (v.change.kind == Change::knock) {
      suspect_rig(CalibrationCause::knock, v.change.onset_frame, v.change.evidence);
    }
  }

  /// Detects a change of the rig during an estimation. Frames before and after the change must not
  /// enter one solve, and later frames must not confirm a solution from earlier ones.
  void watch_estimate(const odometry::FrameOutcome& out) noexcept {
    const auto onset = calibrator.monitor().update_unlinked(odometry, out, last_number);
    if (!onset) return;
    if (!calibrator.estimating()) return suspect_rig(CalibrationCause::knock, *onset);
    record(Kind::rig_changed, "a camera was knocked during the calibration", frames_since(*onset));
    restart_estimation(
        calibrator.calibrated() ? CalibrationCause::knock : CalibrationCause::from_scratch, *onset);
  }

  /// Enters the degradations that a posed frame causes.
  void update_degradations(const odometry::FrameOutcome& out, Pairing pairing) noexcept {
    degradations.set(Degradation::pairing, pairing == Pairing::contradicted,
                     Reason::pairing_ambiguous);
    if (out.restarted) degradations.enter(Degradation::scene, Reason::map_reset, kWindowFrames + 1);
    degradations.set(Degradation::frame, out.status != PoseStatus::ok,
                     out.reason == Reason::uncalibrated ? why_uncalibrated() : out.reason);
    if (state == State::recalibrating) degradations.enter(Degradation::rig, Reason::recalibrating);
    if (out.moving && !degradations.any_up_to(Degradation::rig))
      degradations.enter(Degradation::dynamic_scene, Reason::dynamic_scene, kWindowFrames);
    // Errors of degraded frames stay in the window's keyframes and points, and correcting them
    // disturbs later motions. So poses stay degraded for as many frames as were degraded, at most
    // for a window's length.
    if (out.relinked || out.restarted)
      degradations.clear(Degradation::window);
    else if (out.gap_s > 0 || out.map_rebuilt)
      degradations.enter(Degradation::window, Reason::time_gap, kWindowFrames + 1);
    else if ((out.keyframe || degradations.active(Degradation::window)) &&
             degradations.any_up_to(Degradation::rig))
      degradations.enter(Degradation::window, degradations.strongest(true)->reason,
                         std::min(degradations[Degradation::window].left + 2, kWindowFrames + 1));
  }

  /// Weakens or ends the degradations that a posed frame is evidence against.
  void weaken_degradations(const odometry::FrameOutcome& out) noexcept {
    for (const Degradation degradation :
         {Degradation::scene, Degradation::dynamic_scene, Degradation::window})
      (void)degradations.weaken(degradation);
    // At standstill, an image that is late by an exposure looks the same.
    if (moves && !out.uneven && !options.online) (void)degradations.weaken(Degradation::late_image);
    // The next pose depends on the adopted calibration.
    if (out.relinked && degradations.weaken(Degradation::calibration)) notify_verified();
  }

  /// The most specific known reason for poses of unlinked cameras.
  [[nodiscard]] Reason why_uncalibrated() const noexcept {
    if (calibrator.last_gate() == calibration::Gate::cameras_swapped)
      return Reason::cameras_swapped;
    if (degradations.active(Degradation::out_of_sync)) return Reason::out_of_sync;
    if (calibrator.missing() != Reason::none) return calibrator.missing();
    return state == State::parallel_monocular || state == State::calibrating
               ? Reason::uncalibrated
               : Reason::recalibrating;
  }

  /// Fills in the frame's pose and covariances.
  void propagate(const odometry::FrameOutcome& out, PoseSample* sample) noexcept {
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
  void check_motion(const Mat6& motion, double step_m) noexcept {
    if (degradations.any_up_to(Degradation::rig) || degradations.active(Degradation::dynamic_scene))
      return;
    const double sigma_m = std::sqrt(motion.topLeftCorner<3, 3>().trace());
    if (!covariance_baseline.measurable(step_m, sigma_m)) return;
    if (covariance_baseline.update(sigma_m))
      degradations.enter(Degradation::window, Reason::weak_geometry, kWindowFrames + 1);
    margins.uncertainty = covariance_baseline.margin();
  }

  /// Covariance of the motion since the last pose.
  [[nodiscard]] static Mat6 motion_covariance(const odometry::FrameOutcome& out) noexcept {
    return odometry::motion_covariance(out.fit_covariance, out.expected, out.unseen_s);
  }

  /// Marks the calibration as unverified, because the rig was not monitored during the missed
  /// frames.
  void mark_calibration_unverified() noexcept {
    calibrator.map_lost();
    if (options.online && !degradations.active(Degradation::calibration))
      degradations.enter(Degradation::calibration, Reason::unverified_calibration);
  }

  /// Starts estimating another calibration, because the rig has or may have changed at `onset`.
  void start_estimation(CalibrationCause cause, std::uint64_t onset) noexcept {
    transition(cause == CalibrationCause::requested ? Trigger::requested : Trigger::rig_changed);
    calibrator.start_estimation(cause, onset, last_number);
    degradations.enter(Degradation::rig, Reason::recalibrating);
    degradations.enter(Degradation::calibration, Reason::unverified_calibration);
    length_sigma_percent = kUnlinkedLengthPercent;
    odometry.unlink();
  }

  void suspect_rig(CalibrationCause cause, std::uint64_t onset,
                   const ChangeEvidence& evidence = {}) noexcept {
    record(Kind::rig_changed, message(cause), frames_since(onset), evidence);
    start_estimation(cause, onset);
  }

  /// Handles frames in which left and right hardly match: a verified calibration indicates a large
  /// knock, an unverified one was wrong from the start.
  void give_up_calibration(double frames) noexcept {
    const bool knocked = calibrator.verified();
    const CalibrationCause cause =
        knocked ? CalibrationCause::collapse : CalibrationCause::contradicted;
    record(knocked ? Kind::rig_changed : Kind::calibration_contradicted, message(cause),
           knocked ? frames : 0);
    start_estimation(cause, last_number);
    // The previous extrinsics are not a starting point: on repetitive structure, matches near them
    // are chance.
    odometry.reset_extrinsics();
  }

  /// Restarts the estimation because its frames are of another rig. Without a cause, the estimation
  /// keeps its own.
  void restart_estimation(std::optional<CalibrationCause> cause, std::uint64_t onset) noexcept {
    calibrator.start_estimation(cause, onset, last_number);
    if (state == State::calibrating) transition(Trigger::calibration_rejected);
  }

  void record_out_of_sync(double lag_frames) noexcept {
    if (!degradations.active(Degradation::out_of_sync))
      record(Kind::out_of_sync, message(CalibrationCause::out_of_sync), lag_frames);
    degradations.enter(Degradation::out_of_sync, Reason::out_of_sync, 1);
    calibrator.monitor().question_pairing();
    // Frames out of sync would indicate a lag in the monitor's windows long after its end, and must
    // not enter a calibration.
    calibrator.clear_frames();
  }

  /// Starts solves and acts on their decisions.
  void calibrate() noexcept {
    if (const auto decision = calibrator.decide(last, last_number)) apply(*decision);
    const bool solves = state == State::parallel_monocular || state == State::recalibrating ||
                        state == State::stereo_odometry;
    if (solves && calibrator.can_solve()) {
      calibrator.start_solve();
      if (calibrator.estimating()) transition(Trigger::frames_enough);
    }
    const Reason missing = calibrator.missing();
    if (std::exchange(notified_missing, missing) == missing) return;
    if (missing == Reason::needs_motion)
      record(Kind::calibration_pending, "the rig must move before it can be calibrated");
    else if (missing == Reason::needs_near_structure)
      record(Kind::calibration_pending,
             "near objects must be visible before the rig can be calibrated");
  }

  void apply(const CalibrationDecision& decision) noexcept {
    (void)decisions.push(decision);
    if (decision.focal.contradicted && !focal_contradicted)
      record(Kind::focal_length_contradicted, "the configured focal length does not fit the images",
             decision.focal.measured_px);
    focal_contradicted = decision.focal.contradicted;
    if (decision.not_rigid && !std::exchange(not_rigid, true))
      record(Kind::rig_not_rigid,
             decision.offset_frames == 0
                 ? "the extrinsics keep changing: a camera is loose"
                 : "the images of the cameras are a fraction of a frame apart",
             decision.offset_frames);
    if (decision.is_refinement) {
      apply_refinement(decision);
      return record_length_sigma(decision);
    }
    record_length_sigma(decision);
    if (decision.accepted) {
      record(Kind::calibration_accepted, "a calibration is accepted", decision.calibration.frames);
      adopt(decision);
      transition(Trigger::calibration_accepted);
      return;
    }
    record(Kind::calibration_rejected, decision.reason, decision.calibration.frames);
    if (calibrator.last_gate() == calibration::Gate::no_better) {
      calibrator.keep();
      degradations.clear(Degradation::rig);
      odometry.link(calibrator.in_use());
      transition(Trigger::calibration_kept);
      return;
    }
    if (calibrator.last_gate() == calibration::Gate::out_of_sync) {
      degradations.enter(Degradation::out_of_sync, Reason::out_of_sync, 1);
      calibrator.monitor().question_pairing();
    }
    transition(Trigger::calibration_rejected);
  }

  /// Acts on the decision of a refinement.
  void apply_refinement(const CalibrationDecision& decision) noexcept {
    if (calibrator.last_gate() == calibration::Gate::out_of_sync) return record_out_of_sync(0);
    const bool was_suspect = degradations.active(Degradation::calibration),
               contradicted = decision.cause == CalibrationCause::contradicted;
    if (contradicted && was_suspect)
      record(Kind::calibration_contradicted, "the calibration in use does not fit the rig",
             decision.depth_error_percent, decision.evidence);
    if (decision.accepted) {
      record(Kind::calibration_accepted, "a better calibration is adopted",
             decision.calibration.frames,
             {0, decision.evidence.shift_px, decision.evidence.rotation_mrad});
      adopt(decision);
    }
    // Until the map is rebuilt, poses depend on the calibration before the refinement.
    const bool as_good =
        decision.depth_error_percent <= options.calibration.max_depth_error_percent;
    if (decision.verified && !contradicted) {
      verified_percent = decision.depth_sigma_percent;
      if (!decision.accepted) verified_by = decision.evidence;
      if (!decision.accepted || as_good) degradations.clear(Degradation::calibration);
      if (was_suspect && !degradations.active(Degradation::calibration)) notify_verified();
    } else if (!calibrator.verified() && !degradations.active(Degradation::calibration)) {
      degradations.enter(Degradation::calibration, Reason::unverified_calibration);
    }
  }

  /// Adopts a calibration. Poses depend on it once the map is rebuilt with it; until then the
  /// status of the previous one applies.
  void adopt(const CalibrationDecision& decision) noexcept {
    calibrator.adopt(decision);
    degradations.clear(Degradation::rig);
    verified_percent = decision.depth_sigma_percent;
    verified_by = {};
    degradations.enter(Degradation::calibration, Reason::unverified_calibration,
                       decision.verified ? 1 : DegradationLedger::kUntilCleared);
    odometry.link(decision.calibration);
  }

  /// Updates the relative sigma of lengths: an adopted calibration's own sigma; for one that stays,
  /// combined with its difference from the online estimate.
  void record_length_sigma(const CalibrationDecision& decision) noexcept {
    if (!(decision.depth_sigma_percent > 0)) return;
    if (decision.accepted)
      length_sigma_percent = decision.depth_sigma_percent;
    else if (linked() && calibrator.verified())
      length_sigma_percent = std::hypot(decision.depth_sigma_percent, decision.depth_error_percent);
  }

  void notify_verified() noexcept {
    not_rigid = false;
    record(Kind::calibration_verified, "the calibration in use is verified", verified_percent,
           verified_by);
  }

  EstimatorOptions options;
  odometry::Odometry odometry;
  OnlineCalibrator calibrator;
  odometry::DriftCovariance drift{};
  CovarianceBaseline covariance_baseline{};
  // Margins of the decisions on the last frame.
  DecisionMargins margins{};
  DegradationLedger degradations{};
  // Standard deviation of all lengths, in percent, from the calibration in use.
  double length_sigma_percent;
  State state = State::initialising;
  // Stamp and number of the newest frame.
  Stamp last{};
  std::uint64_t last_number = 0;
  bool any = false;

  // Standard deviation of the depth by the verified calibration, in percent.
  double verified_percent = 0;
  // Evidence that the verified calibration is the rig's.
  ChangeEvidence verified_by;
  // True if an event has reported a wrong focal length.
  bool focal_contradicted = false;
  // True if an event has reported that the rig is not rigid, until a calibration is verified.
  bool not_rigid = false;
  // True if this frame's pose differs from the last one by more than its uncertainty.
  bool moves = false;

  int without_pose = 0;
  // True if a gap was reported and has not ended.
  bool in_gap = false;
  // Number of consecutive frames without stereo matches.
  int unmatched_frames = 0;
  Reason notified_missing = Reason::none;

  std::atomic<bool> requested{false};
  // One frame records at most eight events.
  FixedVector<EstimatorEvent, 16> events;
  // finish() makes at most three decisions.
  FixedVector<CalibrationDecision, 3> decisions;
};

Estimator::Estimator(const EstimatorOptions& options, const RigCalibration& rig,
                     const RigCalibration& nominal, Arena& arena, PairRunner& runner,
                     BackgroundRunner& solver) {
  check(options, rig);
  static_assert(alignof(Parts) <= kCacheLine);
  const auto bytes = arena.make<std::byte>(sizeof(Parts), "estimator");
  parts_ = new (bytes.data()) Parts(options, rig, nominal, arena, runner, solver);
}

Estimator::~Estimator() { parts_->~Parts(); }

PoseSample Estimator::process(const RigFrame& frame) noexcept { return parts_->process(frame); }
void Estimator::finish() noexcept { parts_->finish(); }
void Estimator::request_recalibration() noexcept {
  parts_->requested.store(true, std::memory_order_relaxed);
}
std::span<const EstimatorEvent> Estimator::events() const noexcept { return parts_->events.span(); }
std::span<const CalibrationDecision> Estimator::calibrations() const noexcept {
  return parts_->decisions.span();
}
State Estimator::state() const noexcept { return parts_->state; }
const RigCalibration& Estimator::calibration() const noexcept {
  return parts_->calibrator.in_use();
}
bool Estimator::calibrated() const noexcept { return parts_->calibrator.calibrated(); }
bool Estimator::verified() const noexcept { return parts_->calibrator.verified(); }
const calibration::TrackLog& Estimator::tracks() const noexcept {
  return parts_->calibrator.frames().log();
}
const DecisionMargins& Estimator::margins() const noexcept { return parts_->margins; }

}  // namespace vergence
