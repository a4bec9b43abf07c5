#include "core/estimator/estimator.hpp"

#include <algorithm>
#include <chrono>
#include <new>
#include <stdexcept>
#include <string>

#include <atomic>

#include "core/estimator/transitions.hpp"
#include "core/memory/fixed_vector.hpp"
#include "core/odometry/odometry.hpp"

namespace vergence {
namespace {

constexpr int kLostAfter = 3;  // frames without a pose in a row before the state says so

void check(const RigCalibration& rig) {
  if (rig.cameras < 2 || rig.cameras > kMaxCameras)
    throw std::invalid_argument("a rig of 2 to " + std::to_string(kMaxCameras) + " cameras is needed, this one has " +
                                std::to_string(rig.cameras));
  for (int k = 0; k < rig.cameras; ++k) {
    const auto i = static_cast<std::size_t>(k);
    const Intrinsics& c = rig.intrinsics[i];
    if (c.width < 64 || c.height < 64 || !(c.fx > 0) || !(c.fy > 0))
      throw std::invalid_argument("camera " + std::to_string(k) +
                                  ": images of at least 64×64 pixels and positive focal lengths are needed");
    if (k > 0 && !(rig.T_camera_left[i].t.norm() > 1e-3))
      throw std::invalid_argument("camera " + std::to_string(k) + ": its baseline is below a millimetre, no depth can be measured");
  }
}

}  // namespace

struct Estimator::Parts {
  Parts(const EstimatorOptions& o, const RigCalibration& r, Arena& arena, PairRunner& runner)
      : options(o), rig(r), odometry(options.odometry, rig, arena, runner) {}

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

  EstimatorOptions options;
  RigCalibration rig;
  odometry::Odometry odometry;
  State state = State::initialising;
  Stamp last{};
  bool any = false;
  int without_pose = 0;
  std::atomic<bool> requested{false};
  FixedVector<EstimatorEvent, 8> events;  // a frame raises at most four
};

std::size_t Estimator::memory_needed(const EstimatorOptions& options, const RigCalibration& rig) {
  check(rig);
  return odometry::Odometry::memory_needed(options.odometry, rig) + sizeof(Parts) + 2 * kCacheLine;
}

Estimator::Estimator(const EstimatorOptions& options, const RigCalibration& rig, const RigCalibration& /*nominal*/, Arena& arena,
                     PairRunner& runner, BackgroundRunner& /*solver*/) {
  check(rig);
  static_assert(alignof(Parts) <= kCacheLine);
  const auto bytes = arena.make<std::byte>(sizeof(Parts), "estimator");
  parts_ = new (bytes.data()) Parts(options, rig, arena, runner);
}

Estimator::~Estimator() { parts_->~Parts(); }

PoseSample Estimator::process(const RigFrame& frame) noexcept {
  const auto start = std::chrono::steady_clock::now();
  Parts& p = *parts_;
  p.events.clear();
  PoseSample sample;
  sample.frame = frame.number;
  sample.stamp = frame.stamp;
  sample.state = p.state;
  if (p.any && !(frame.stamp > p.last)) {
    sample.reason = Reason::time_gap;
    p.note(EstimatorEvent::Kind::dropped, frame.stamp, "the frame is not newer than the one before", (p.last - frame.stamp).to_seconds());
    return sample;
  }
  p.any = true;
  p.last = frame.stamp;
  if (p.state == State::initialising) p.transition(Trigger::calibration_given, frame.stamp);

  const odometry::FrameOutcome out = p.odometry.process(frame);
  if (out.gap_s > 0) p.note(EstimatorEvent::Kind::time_gap, frame.stamp, "no frame for longer than motion can be predicted", out.gap_s);
  if (out.posed) {
    p.without_pose = 0;
    if (p.state == State::lost) p.transition(Trigger::pose_found, frame.stamp);
    if (out.restarted)
      p.note(EstimatorEvent::Kind::scene_restarted, frame.stamp, "the scene was built anew; the way since the last pose is extrapolated",
             out.gap_s);
    if (out.relocalised) p.note(EstimatorEvent::Kind::relocalised, frame.stamp, "found again among the window's points", 0);
  } else if (++p.without_pose == kLostAfter) {
    p.transition(Trigger::pose_lost, frame.stamp);
  }
  sample.state = p.state;
  sample.status = out.posed ? out.status : PoseStatus::lost;
  sample.reason = out.reason;
  if (out.posed) sample.T_world_left = out.T_left_world.inverse();
  sample.inliers = out.inliers;
  sample.stereo_inliers = out.stereo_inliers;
  sample.reprojection_px = out.reprojection_px;
  sample.keyframe = out.keyframe;
  sample.stage_ms = out.stage_ms;
  sample.estimate_ms = std::chrono::duration<float, std::milli>(std::chrono::steady_clock::now() - start).count();
  return sample;
}

std::span<const EstimatorEvent> Estimator::events() const noexcept { return parts_->events.span(); }
State Estimator::state() const noexcept { return parts_->state; }
const RigCalibration& Estimator::calibration() const noexcept { return parts_->rig; }
bool Estimator::calibrated() const noexcept { return true; }
void Estimator::request_recalibration() noexcept { parts_->requested.store(true, std::memory_order_relaxed); }
std::span<const CalibrationDecision> Estimator::calibrations() const noexcept { return {}; }

}  // namespace vergence
