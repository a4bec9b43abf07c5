#include "core/estimator/estimator.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <new>
#include <stdexcept>
#include <string>
#include <utility>

#include "core/estimator/online_calibrator.hpp"
#include "core/estimator/transitions.hpp"
#include "core/memory/fixed_vector.hpp"
#include "core/odometry/odometry.hpp"

namespace vergence {
namespace {

constexpr int kLostAfter = 3;  // frames without a pose in a row before the state says so

constexpr std::uint64_t kDriftFrames = 60;  // of a creeping rig that are taken for one
// Frames with good images that no scene can be made of with the calibration in use; and with one
// that no frame of the drive has agreed with yet.
constexpr int kUnmatchedAfter = 15, kUnmatchedClaimAfter = 6;
constexpr int kInStepAfter =
    60;  // frames without a sign of the cameras being out of step, before that is over

/// What must be known of a rig.
void check(const EstimatorOptions& options, const RigCalibration& rig) {
  const bool known = options.trust != CalibrationTrust::none;
  if (rig.cameras < 2 || rig.cameras > kMaxCameras)
    throw std::invalid_argument("a rig of 2 to " + std::to_string(kMaxCameras) +
                                " cameras is needed, this one has " + std::to_string(rig.cameras));
  for (int k = 0; k < rig.cameras; ++k) {
    const auto i = static_cast<std::size_t>(k);
    const Intrinsics& c = rig.intrinsics[i];
    if (c.width < 64 || c.height < 64 || !(c.fx > 0) || !(c.fy > 0))
      throw std::invalid_argument(
          "camera " + std::to_string(k) +
          ": images of at least 64×64 pixels and positive focal lengths are needed");
    const ImageView& mask = options.masks[i];
    if (!mask.empty() && (mask.width != c.width || mask.height != c.height))
      throw std::invalid_argument("camera " + std::to_string(k) + ": its mask is " +
                                  std::to_string(mask.width) + "×" + std::to_string(mask.height) +
                                  " pixels, its images are " + std::to_string(c.width) + "×" +
                                  std::to_string(c.height));
    if (k > 0 && known && !(rig.T_camera_left[i].t.norm() > 1e-3))
      throw std::invalid_argument("camera " + std::to_string(k) +
                                  ": its baseline is below a millimetre, no depth can be measured");
  }
  if (!known && !(rig.baseline > 1e-3))
    throw std::invalid_argument(
        "the length of the baseline is needed to calibrate from scratch: it sets the scale of "
        "everything");
}

/// From which frame on the tracks tell of the rig as it is now.
std::uint64_t first_frame_of_use(const calibration::MonitorVerdict& v, std::uint64_t now) noexcept {
  using K = calibration::MonitorVerdict::Kind;
  if (v.kind == K::collapse) return now;  // until now there were wrong matches only
  // A rig that creeps is another one by and by.
  if (v.kind == K::drift) return std::max(v.onset_frame, now - std::min(now, kDriftFrames));
  return v.onset_frame;
}

CalibrationCause cause_of(calibration::MonitorVerdict::Kind kind) noexcept {
  using K = calibration::MonitorVerdict::Kind;
  switch (kind) {
    case K::drift:
      return CalibrationCause::drift;
    case K::collapse:
      return CalibrationCause::collapse;
    case K::out_of_step:
      return CalibrationCause::out_of_step;
    case K::knock:
    case K::quiet:
      break;
  }
  return CalibrationCause::knock;
}

const char* sentence_of(CalibrationCause cause) noexcept {
  switch (cause) {
    case CalibrationCause::from_scratch:
      return "there is no calibration";
    case CalibrationCause::knock:
      return "the rig has changed: a camera was knocked";
    case CalibrationCause::drift:
      return "the rig is creeping away from its calibration";
    case CalibrationCause::collapse:
      return "left and right hardly match any more: a camera was knocked far off or is out of "
             "focus";
    case CalibrationCause::out_of_step:
      return "the cameras' images are not of the same instant";
    case CalibrationCause::requested:
      return "a new calibration is asked for";
    case CalibrationCause::contradicted:
      return "left and right hardly match with the calibration in use: it is not that of the rig";
    case CalibrationCause::refinement:
      break;  // no reason to seek one
  }
  return "";
}

/// The frame as it may be used: where the pairing is contradicted, its first image alone.
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

}  // namespace

struct Estimator::Parts {
  Parts(const EstimatorOptions& o, const RigCalibration& r, const RigCalibration& nominal,
        Arena& arena, PairRunner& runner, BackgroundRunner& solver)
      : options(o),
        odometry(options.odometry, r, o.trust != CalibrationTrust::none, arena, runner, o.masks),
        calibrator(options, r, nominal, arena, solver),
        unconfirmed(o.trust == CalibrationTrust::unconfirmed) {}

  void transition(Trigger trigger, Stamp stamp) noexcept {
    const Transition* t = find_transition(state, trigger);
    if (t == nullptr) return;
    EstimatorEvent e;
    e.stamp = stamp;
    e.kind = EstimatorEvent::Kind::state;
    e.from = t->from;
    e.to = t->to;
    e.why = t->why;
    (void)events.push(e);
    state = t->to;
  }
  void note(EstimatorEvent::Kind kind, Stamp stamp, const char* why, double value) noexcept {
    EstimatorEvent e;
    e.stamp = stamp;
    e.kind = kind;
    e.from = e.to = state;
    e.why = why;
    e.value = value;
    (void)events.push(e);
  }

  void doubt(CalibrationCause cause, std::uint64_t onset, const RigFrame& frame) noexcept;
  void give_up_calibration(const RigFrame& frame, double frames) noexcept;
  void watch(const odometry::FrameOutcome& out, const RigFrame& frame) noexcept;
  void watch_sought(const odometry::FrameOutcome& out, const RigFrame& frame) noexcept;
  void calibrate(const RigFrame& frame) noexcept;
  void take(const CalibrationDecision& decision, Stamp stamp) noexcept;
  void take_learnt(const CalibrationDecision& decision, bool was_verified, Stamp stamp) noexcept;
  void tell_verified(bool was_verified, const CalibrationDecision& decision, Stamp stamp) noexcept;
  void tell_confirmed(Stamp stamp) noexcept;
  void follow(const odometry::FrameOutcome& out, const RigFrame& frame) noexcept;
  void tell_missing(Stamp stamp) noexcept;
  void grade(const odometry::FrameOutcome& out, Pairing pairing, PoseSample* sample) const noexcept;
  [[nodiscard]] Reason why_uncalibrated() const noexcept;

  EstimatorOptions options;
  odometry::Odometry odometry;
  OnlineCalibrator calibrator;
  State state = State::initialising;
  Stamp last{};
  std::uint64_t last_number = 0;
  bool any = false;
  bool unconfirmed;              // the calibration in use is the last drive's
  bool undecided = false;        // something is wrong with the rig, and not yet told what
  bool verified = false;         // the calibration in use, when last decided about
  double confirmed_percent = 0;  // depth error of the calibration that was confirmed
  bool relinked = false;         // the frame before took up the calibration that was adopted
  bool superseded = false;       // poses still are of a calibration that was contradicted
  int out_of_step = 0;           // frames for which that is still believed
  int without_pose = 0;
  bool in_gap = false;       // and the last event has said so
  int unmatched_frames = 0;  // in a row
  bool ever_posed = false;
  Reason told_missing = Reason::none;
  std::atomic<bool> requested{false};
  FixedVector<EstimatorEvent, 16> events;         // a frame raises at most eight
  FixedVector<CalibrationDecision, 3> decisions;  // three in finish() at most
};

void Estimator::Parts::doubt(CalibrationCause cause, std::uint64_t onset,
                             const RigFrame& frame) noexcept {
  note(EstimatorEvent::Kind::rig_changed, frame.stamp, sentence_of(cause),
       static_cast<double>(frame.number - std::min(onset, frame.number)));
  transition(cause == CalibrationCause::requested ? Trigger::requested : Trigger::rig_changed,
             frame.stamp);
  calibrator.seek(cause, onset, frame.number);
  verified = superseded = false;
  odometry.unlink();
}

/// Left and right hardly match with the calibration in use. One that the drive never confirmed was
/// not the rig's from the start; one that it did was knocked away.
void Estimator::Parts::give_up_calibration(const RigFrame& frame, double frames) noexcept {
  const CalibrationCause cause =
      calibrator.ever_verified() ? CalibrationCause::collapse : CalibrationCause::contradicted;
  if (cause == CalibrationCause::collapse)
    note(EstimatorEvent::Kind::rig_changed, frame.stamp, sentence_of(cause), frames);
  else
    note(EstimatorEvent::Kind::calibration_contradicted, frame.stamp, sentence_of(cause), 0);
  transition(Trigger::rig_changed, frame.stamp);
  calibrator.seek(cause, frame.number, frame.number);
  verified = superseded = false;
  odometry.unlink();
}

/// What the monitors say of a frame posed with the calibration in use.
void Estimator::Parts::watch(const odometry::FrameOutcome& out, const RigFrame& frame) noexcept {
  using K = calibration::MonitorVerdict::Kind;
  const calibration::MonitorVerdict v = calibrator.watch(odometry, out, frame);
  undecided = v.undecided;
  if (v.kind == K::out_of_step) {
    if (out_of_step == 0)
      note(EstimatorEvent::Kind::rig_changed, frame.stamp,
           sentence_of(CalibrationCause::out_of_step), v.lag_frames);
    out_of_step = kInStepAfter;
    return;
  }
  if (out_of_step > 0) {
    // A rig out of step fits no calibration: what else the monitor says is of no use until that is
    // over.
    if (v.kind == K::quiet && !v.undecided && --out_of_step == 0)
      note(EstimatorEvent::Kind::calibration_confirmed, frame.stamp,
           "the cameras are in step again", 0);
    return;
  }
  if (v.kind == K::collapse) {
    give_up_calibration(frame,
                        static_cast<double>(frame.number - std::min(v.onset_frame, frame.number)));
  } else if (v.kind != K::quiet) {
    doubt(cause_of(v.kind), first_frame_of_use(v, frame.number), frame);
  }
}

/// A rig that changes while it is sought: frames before and after are never one solve, and those
/// after do not confirm those before.
void Estimator::Parts::watch_sought(const odometry::FrameOutcome& out,
                                    const RigFrame& frame) noexcept {
  const auto onset = calibrator.watch_sought(odometry, out, frame.number);
  if (!onset) return;
  if (!calibrator.seeking()) return doubt(CalibrationCause::knock, *onset, frame);
  note(EstimatorEvent::Kind::rig_changed, frame.stamp,
       "a camera was knocked while the calibration was sought",
       static_cast<double>(frame.number - *onset));
  calibrator.seek(
      calibrator.calibrated() ? CalibrationCause::knock : CalibrationCause::from_scratch, *onset,
      frame.number);
  if (state == State::calibrating) transition(Trigger::calibration_rejected, frame.stamp);
}

/// Solves are started and decided.
void Estimator::Parts::calibrate(const RigFrame& frame) noexcept {
  if (const auto decision = calibrator.decide(frame.stamp, frame.number))
    take(*decision, frame.stamp);
  const bool solves = state == State::parallel_monocular || state == State::recalibrating ||
                      state == State::stereo_odometry;
  if (solves && calibrator.can_solve()) {
    calibrator.start_solve();
    if (calibrator.seeking()) transition(Trigger::frames_enough, frame.stamp);
  }
  tell_missing(frame.stamp);
}

/// What the drive has measured of the rig while it went on.
void Estimator::Parts::take_learnt(const CalibrationDecision& decision, bool was_verified,
                                   Stamp stamp) noexcept {
  if (decision.cause == CalibrationCause::contradicted && !was_verified)
    note(EstimatorEvent::Kind::calibration_contradicted, stamp,
         "the calibration in use is not that of the rig", decision.depth_difference_percent);
  if (decision.accepted) {
    note(EstimatorEvent::Kind::calibration_accepted, stamp, "a better calibration is adopted",
         decision.calibration.frames);
    calibrator.refine(decision.calibration);
    odometry.link(decision.calibration);
    superseded = decision.cause == CalibrationCause::contradicted;
    undecided = false;
  }
  tell_verified(was_verified, decision, stamp);
}

void Estimator::Parts::tell_verified(bool was_verified, const CalibrationDecision& decision,
                                     Stamp stamp) noexcept {
  if (!calibrator.verified() || was_verified) return;
  unconfirmed = false;
  confirmed_percent = decision.depth_sigma_percent;
  if (!superseded) tell_confirmed(stamp);
}

void Estimator::Parts::tell_confirmed(Stamp stamp) noexcept {
  note(EstimatorEvent::Kind::calibration_confirmed, stamp,
       "the drive confirms the calibration in use", confirmed_percent);
}

void Estimator::Parts::take(const CalibrationDecision& decision, Stamp stamp) noexcept {
  (void)decisions.push(decision);
  const bool was_verified = verified;
  verified = calibrator.verified();
  if (decision.learnt) return take_learnt(decision, was_verified, stamp);
  if (decision.accepted) {
    note(EstimatorEvent::Kind::calibration_accepted, stamp, "a calibration is accepted",
         decision.calibration.frames);
    calibrator.use(decision.calibration, decision.lenses);
    odometry.link(decision.calibration);
    undecided = false;
    transition(Trigger::calibration_accepted, stamp);
    tell_verified(was_verified, decision, stamp);
    return;
  }
  note(EstimatorEvent::Kind::calibration_rejected, stamp, decision.reason,
       decision.calibration.frames);
  switch (calibrator.last_gate()) {
    case calibration::Gate::no_better:
      calibrator.keep();
      odometry.link(calibrator.in_use());
      transition(Trigger::calibration_kept, stamp);
      break;
    case calibration::Gate::out_of_step:
      out_of_step = kInStepAfter;
      [[fallthrough]];
    default:
      transition(Trigger::calibration_rejected, stamp);
  }
}

void Estimator::Parts::tell_missing(Stamp stamp) noexcept {
  const Reason missing = calibrator.missing();
  if (missing == told_missing) return;
  told_missing = missing;
  if (missing == Reason::needs_motion)
    note(EstimatorEvent::Kind::calibration_waits, stamp,
         "the rig has to move before it can be calibrated", 0);
  else if (missing == Reason::needs_near_structure)
    note(EstimatorEvent::Kind::calibration_waits, stamp,
         "nearer things have to be seen before the rig can be calibrated", 0);
}

/// States that follow from whether there is a pose.
void Estimator::Parts::follow(const odometry::FrameOutcome& out, const RigFrame& frame) noexcept {
  // Once a gap: covered cameras give frame after frame that lies behind it.
  if (out.gap_s > 0 && !in_gap)
    note(EstimatorEvent::Kind::time_gap, frame.stamp,
         "no frame for longer than motion can be predicted", out.gap_s);
  in_gap = out.gap_s > 0 && !out.posed;
  const bool unmatched = !out.posed && out.images_good && out.reason == Reason::no_stereo_matches &&
                         odometry.linked() == odometry::Link::linked;
  unmatched_frames = unmatched ? unmatched_frames + 1 : 0;
  const int unmatched_after = ever_posed ? kUnmatchedAfter : kUnmatchedClaimAfter;
  if (options.online && unmatched_frames == unmatched_after) {
    unmatched_frames = 0;
    // Good images of which no scene can be made: then it is the rig that does not fit.
    give_up_calibration(frame, unmatched_after);
    odometry.reset_extrinsics();
  }
  if (!out.posed) {
    if (++without_pose == kLostAfter) {
      transition(Trigger::pose_lost, frame.stamp);
      calibrator.scene_lost();
    }
    return;
  }
  without_pose = 0;
  ever_posed = true;
  if (state == State::lost)
    transition(odometry.linked() == odometry::Link::linked ? Trigger::pose_found
               : calibrator.calibrated()                   ? Trigger::pose_found_doubtful
                                                           : Trigger::pose_found_uncalibrated,
               frame.stamp);
  if (state == State::initialising) {
    transition(Trigger::pair_found, frame.stamp);
    calibrator.seek(CalibrationCause::from_scratch, 0, frame.number);
  }
  if (out.restarted) {
    note(EstimatorEvent::Kind::scene_restarted, frame.stamp,
         "the map was rebuilt; the motion since the last pose is extrapolated", out.gap_s);
    calibrator.scene_lost();
  }
  if (out.relocalised)
    note(EstimatorEvent::Kind::relocalised, frame.stamp, "found again among the window's points",
         0);
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

/// What a pose of cameras that are not linked says of its calibration: the most particular that is
/// known.
Reason Estimator::Parts::why_uncalibrated() const noexcept {
  if (calibrator.last_gate() == calibration::Gate::cameras_swapped) return Reason::cameras_swapped;
  if (out_of_step > 0) return Reason::out_of_step;
  if (calibrator.missing() != Reason::none) return calibrator.missing();
  return state == State::parallel_monocular || state == State::calibrating ? Reason::uncalibrated
                                                                           : Reason::recalibrating;
}

std::size_t Estimator::memory_needed(const EstimatorOptions& options, const RigCalibration& rig) {
  check(options, rig);
  return odometry::Odometry::memory_needed(options.odometry, rig, options.masks) +
         OnlineCalibrator::memory_needed(options, rig) + sizeof(Parts) + 2 * kCacheLine;
}

Estimator::Estimator(const EstimatorOptions& options, const RigCalibration& rig,
                     const RigCalibration& nominal, Arena& arena, PairRunner& runner,
                     BackgroundRunner& solver) {
  check(options, rig);
  static_assert(alignof(Parts) <= kCacheLine);
  const auto bytes = arena.make<std::byte>(sizeof(Parts), "estimator");
  parts_ = new (bytes.data()) Parts(options, rig, nominal, arena, runner, solver);
}

Estimator::~Estimator() {
  parts_->calibrator.finish();
  parts_->~Parts();
}

PoseSample Estimator::process(const RigFrame& given) noexcept {
  const auto start = std::chrono::steady_clock::now();
  const RigFrame frame = usable(given);
  Parts& p = *parts_;
  p.events.clear();
  p.decisions.clear();
  PoseSample sample;
  sample.frame = frame.number;
  sample.stamp = frame.stamp;
  sample.state = p.state;
  if (p.any && !(frame.stamp > p.last)) {
    sample.reason = Reason::time_gap;
    p.note(EstimatorEvent::Kind::dropped, frame.stamp, "the frame is not newer than the one before",
           (p.last - frame.stamp).to_seconds());
    return sample;
  }
  p.any = true;
  p.last = frame.stamp;
  p.last_number = frame.number;
  if (p.state == State::initialising && p.calibrator.calibrated())
    p.transition(Trigger::calibration_given, frame.stamp);
  if (p.requested.exchange(false, std::memory_order_relaxed) && p.state == State::stereo_odometry &&
      p.options.online)
    p.doubt(CalibrationCause::requested, frame.number, frame);

  if (p.relinked && std::exchange(p.superseded, false) && p.calibrator.verified())
    p.tell_confirmed(frame.stamp);
  odometry::FrameOutcome out = p.odometry.process(frame, p.options.frame_budget);
  p.follow(out, frame);
  if (p.options.online) {
    if (out.posed) {
      const bool linked = p.odometry.linked() == odometry::Link::linked;
      if (linked && p.state == State::stereo_odometry && !out.restarted) p.watch(out, frame);
      if (!linked && (p.calibrator.seeking() || p.calibrator.relink_pending()))
        p.watch_sought(out, frame);
      p.calibrator.log(p.odometry, out, frame);
    }
    p.odometry.rebuild(&out);
    if (out.relinked) p.calibrator.scene_rebuilt(p.odometry);
    p.calibrate(frame);
  }
  sample.state = p.state;
  p.grade(out, frame.pairing, &sample);
  p.relinked = out.relinked;
  if (out.posed) sample.T_world_left = out.T_left_world.inverse();
  sample.inliers = out.inliers;
  sample.stereo_inliers = out.stereo_inliers;
  sample.reprojection_px = out.reprojection_px;
  sample.keyframe = out.keyframe;
  sample.effort = out.effort;
  sample.stage_ms = out.stage_ms;
  // Waiting for the solver makes a replay the same on every machine; it is no part of a frame's
  // work.
  sample.estimate_ms =
      std::chrono::duration<float, std::milli>(std::chrono::steady_clock::now() - start).count() -
      p.calibrator.waited_ms();
  return sample;
}

void Estimator::finish() noexcept {
  Parts& p = *parts_;
  p.events.clear();
  p.decisions.clear();
  if (!p.options.online) return;
  // One solve may be under way, what it lacked the frames since then may give, and what is known by
  // then all frames can make better.
  constexpr int kLastSolves = 3;
  for (int attempt = 0; attempt < kLastSolves; ++attempt) {
    if (!p.calibrator.solving()) {
      if (!p.calibrator.start_last_solve()) return;
      if (p.calibrator.seeking()) p.transition(Trigger::frames_enough, p.last);
    }
    if (const auto decision = p.calibrator.decide_now(p.last, p.last_number))
      p.take(*decision, p.last);
  }
}

std::span<const EstimatorEvent> Estimator::events() const noexcept { return parts_->events.span(); }
std::span<const CalibrationDecision> Estimator::calibrations() const noexcept {
  return parts_->decisions.span();
}
void Estimator::request_recalibration() noexcept {
  parts_->requested.store(true, std::memory_order_relaxed);
}
State Estimator::state() const noexcept { return parts_->state; }
const RigCalibration& Estimator::calibration() const noexcept {
  return parts_->calibrator.in_use();
}
bool Estimator::verified() const noexcept { return parts_->calibrator.verified(); }
const calibration::TrackLog& Estimator::tracks() const noexcept {
  return parts_->calibrator.tracks();
}
bool Estimator::calibrated() const noexcept { return parts_->calibrator.calibrated(); }

}  // namespace vergence
