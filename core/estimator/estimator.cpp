#include "core/estimator/estimator.hpp"

#include <atomic>
#include <chrono>
#include <new>
#include <stdexcept>
#include <string>

#include "core/estimator/detail/estimator_parts.hpp"

namespace vergence {
namespace {

/// Throws std::invalid_argument if the rig or the options cannot be used.
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

}  // namespace

Estimator::Estimator(const EstimatorOptions& options, const RigCalibration& rig,
                     const RigCalibration& nominal, Arena& arena, PairRunner& runner,
                     BackgroundRunner& solver) {
  check(options, rig);
  static_assert(alignof(Parts) <= kCacheLine);
  const auto bytes = arena.make<std::byte>(sizeof(Parts), "estimator");
  parts_ = new (bytes.data()) Parts(options, rig, nominal, arena, runner, solver);
}

Estimator::~Estimator() { parts_->~Parts(); }

PoseSample Estimator::process(const RigFrame& given) noexcept {
  const auto start = std::chrono::steady_clock::now();
  const RigFrame frame = usable(given);
  Parts& p = *parts_;
  p.events.clear();
  p.decisions.clear();
  p.margins = {};
  PoseSample sample;
  sample.frame = frame.number;
  sample.stamp = frame.stamp;
  sample.state = p.state;
  if (p.any && !(frame.stamp > p.last)) {
    sample.reason = Reason::time_gap;
    p.record(EstimatorEvent::Kind::dropped, frame.stamp,
             "the frame is not newer than the one before", (p.last - frame.stamp).to_seconds());
    return sample;
  }
  p.any = true;
  p.last = frame.stamp;
  p.last_number = frame.number;
  if (p.state == State::initialising && p.calibrator.calibrated())
    p.transition(Trigger::calibration_given, frame.stamp);
  // A request made while there is no pose waits until there is one.
  const bool can_be_asked = p.state != State::lost && p.state != State::initialising;
  if (can_be_asked && p.requested.exchange(false, std::memory_order_relaxed) &&
      p.state == State::stereo_odometry && p.options.online)
    p.suspect_rig(CalibrationCause::requested, frame.number, frame);

  p.odometry.trust_rig(!p.degradations.active(Degradation::calibration));
  odometry::FrameOutcome out = p.odometry.process(frame, p.options.frame_budget);
  p.follow(out, frame);
  if (p.options.online) {
    if (out.posed) {
      const bool linked = p.odometry.linked() == odometry::Link::linked;
      if (linked && p.state == State::stereo_odometry && !out.restarted) p.watch(out, frame);
      if (!linked && (p.calibrator.estimating() || p.calibrator.monitor().map_rebuild_pending()))
        p.watch_estimate(out, frame);
      // Images that are out of sync cannot be used for calibration, even if no lag is visible for a
      // while.
      if (!p.degradations.active(Degradation::out_of_sync) || p.state != State::stereo_odometry)
        p.calibrator.frames().add(p.odometry, out, frame);
    }
  }
  p.odometry.rebuild(&out);
  if (p.options.online) {
    if (out.relinked) {
      p.calibrator.map_rebuilt(p.odometry);
      if (out.relink_due)
        p.record(EstimatorEvent::Kind::calibration_applied, frame.stamp,
                 "the map uses the accepted calibration", 100 * out.points_kept);
    }
    if (out.map_rebuilt) p.calibrator.monitor().map_rebuilt(p.odometry.map());
    p.calibrate(frame);
  }
  sample.state = p.state;
  sample.reason = out.reason;
  if (out.posed) {
    p.update_degradations(out, frame.pairing);
    p.propagate(out, &sample);
    const DegradationLedger::Entry* why = p.degradations.strongest(p.moves);
    sample.status = why == nullptr ? PoseStatus::ok : PoseStatus::degraded;
    sample.reason = why == nullptr ? Reason::none : why->reason;
    p.weaken_degradations(out, frame.stamp);
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
      p.calibrator.solve().waited_ms();
  return sample;
}

void Estimator::finish() noexcept {
  Parts& p = *parts_;
  p.events.clear();
  p.decisions.clear();
  if (!p.options.online) return;
  // At most: the solve that is running, one with the frames logged since, and a refinement with all
  // frames.
  while (!p.decisions.full()) {
    if (!p.calibrator.solve().running()) {
      if (!p.calibrator.start_last_solve()) return;
      if (p.calibrator.estimating()) p.transition(Trigger::frames_enough, p.last);
    }
    if (const auto decision = p.calibrator.decide_now(p.last, p.last_number))
      p.apply(*decision, p.last);
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
  return parts_->calibrator.frames().log();
}
const DecisionMargins& Estimator::margins() const noexcept { return parts_->margins; }
bool Estimator::calibrated() const noexcept { return parts_->calibrator.calibrated(); }

}  // namespace vergence
