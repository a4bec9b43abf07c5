#include "tests/system/odometry/estimator_run.hpp"

#include <cmath>

#include <fmt/format.h>

#include "app/runtime/background_thread.hpp"
#include "core/memory/allocation_guard.hpp"

namespace vergence::test {

namespace {
/// Parallel cameras as far apart as the true ones: all that a configuration knows.
RigCalibration nominal_of(const RigCalibration& rig) {
  RigCalibration n = rig;
  for (int k = 1; k < rig.cameras; ++k) {
    const auto c = static_cast<std::size_t>(k);
    n.T_camera_left[c] = {Mat3::Identity(), Vec3(-rig.T_camera_left[c].t.norm(), 0, 0)};
  }
  return n;
}

/// One line for every run of frames with the same status and reason.
std::string describe_frames(const std::vector<FrameResult>& results) {
  std::string text, last;
  for (const FrameResult& r : results) {
    const PoseSample& s = r.sample;
    const std::string state = fmt::format("{} {}", to_string(s.status), to_string(s.reason));
    if (state != last || r.map_reset)
      text += fmt::format("from frame {}: {}, {} inliers{}\n", s.frame, state, s.inliers,
                          r.map_reset ? ", map reset" : "");
    last = state;
  }
  return text;
}
}  // namespace

EstimatorRunOptions with_supplied(const RigCalibration& rig) { return {{}, rig, rig}; }

EstimatorRunOptions from_scratch(const RigCalibration& rig) {
  EstimatorRunOptions s{{}, rig, nominal_of(rig)};
  s.options.trust = CalibrationTrust::none;
  s.options.calibration.intrinsics = calibration::IntrinsicsEstimation::fixed;
  for (Transform& T : s.initial.T_camera_left) T = {};
  return s;
}

EstimatorRunOptions with_calibration(const RigCalibration& rig) {
  EstimatorRunOptions s{{}, rig, nominal_of(rig)};
  s.options.calibration.intrinsics = calibration::IntrinsicsEstimation::fixed;
  for (std::size_t k = 1; k < static_cast<std::size_t>(rig.cameras); ++k)
    s.initial.sigma_noise[k] = s.initial.sigma_total[k] = {2e-5, 3e-5, 2e-5, 1e-5, 4e-4, 7e-4};
  return s;
}

struct EstimatorRun::Parts {
  explicit Parts(const EstimatorRunOptions& s) {
    if (s.threads > 1) {
      two.emplace();
      beside.emplace();
    }
    estimator.emplace(s.options, s.initial, s.nominal, arena,
                      two ? static_cast<PairRunner&>(*two) : one,
                      beside ? static_cast<BackgroundRunner&>(*beside) : at_once);
  }
  Arena arena;
  SequentialRunner one;
  ImmediateRunner at_once;
  std::optional<app::ThreadRunner> two;
  std::optional<app::BackgroundThread> beside;
  std::optional<Estimator> estimator;
};

EstimatorRun::EstimatorRun(const EstimatorRunOptions& setting)
    : parts_(std::make_unique<Parts>(setting)),
      allocations_before_(AllocationGuard::runtime_allocations()) {}
EstimatorRun::~EstimatorRun() = default;
const Estimator& EstimatorRun::estimator() const noexcept { return *parts_->estimator; }

void EstimatorRun::record(std::uint64_t frame) {
  for (const EstimatorEvent& e : parts_->estimator->events()) events_.push_back({frame, e});
  for (const CalibrationDecision& d : parts_->estimator->calibrations())
    if (!d.is_refinement) decisions_.push_back({frame, d});
}

void EstimatorRun::process(const RigFrame& frame, const Transform& T_reference_left) {
  FrameResult a;
  {
    const SealedScope sealed;
    a.sample = parts_->estimator->process(frame);
  }
  a.T_reference_left = T_reference_left;
  for (const EstimatorEvent& e : parts_->estimator->events())
    a.map_reset = a.map_reset || e.kind == EstimatorEvent::Kind::map_reset;
  results_.push_back(a);
  last_ = frame.number;
  record(frame.number);
}

void EstimatorRun::process(const StereoDrive& drive, std::size_t first, std::size_t last,
                           const Edit& edit) {
  for (std::size_t i = first; i < std::min(last, drive.size()); ++i) {
    RigFrame frame = drive.frame(i);
    if (edit && !edit(i, &frame)) continue;
    process(frame, drive.truth[i]);
  }
}

std::uint64_t EstimatorRun::allocations() const noexcept {
  return AllocationGuard::runtime_allocations() - allocations_before_;
}

void EstimatorRun::finish() {
  parts_->estimator->finish();
  record(last_);
}

const CalibrationDecision* EstimatorRun::accepted() const noexcept {
  for (auto d = decisions_.rbegin(); d != decisions_.rend(); ++d)
    if (d->decision.accepted) return &d->decision;
  return nullptr;
}

int EstimatorRun::count_accepted() const noexcept {
  return static_cast<int>(
      std::count_if(decisions_.begin(), decisions_.end(),
                    [](const TimedDecision& d) { return d.decision.accepted; }));
}

const TimedEvent* EstimatorRun::first(EstimatorEvent::Kind kind) const noexcept {
  const auto found = std::find_if(events_.begin(), events_.end(),
                                  [kind](const TimedEvent& t) { return t.event.kind == kind; });
  return found == events_.end() ? nullptr : &*found;
}

bool EstimatorRun::rejected_for(const std::string& reason) const noexcept {
  return std::any_of(decisions_.begin(), decisions_.end(), [&](const TimedDecision& d) {
    return !d.decision.accepted && reason == d.decision.reason;
  });
}

std::string EstimatorRun::describe() const {
  std::string text = describe_frames(results_);
  for (const TimedEvent& t : events_)
    text += fmt::format("frame {}: {} ({:.3g})\n", t.frame, t.event.why, t.event.value);
  for (const TimedDecision& d : decisions_)
    text +=
        fmt::format("frame {}: {} from {} frames, {:.3f} px, held out {:.3f} to {:.3f} px {}\n",
                    d.frame, d.decision.accepted ? "accepted" : "rejected",
                    d.decision.calibration.frames, d.decision.calibration.reprojection_px,
                    d.decision.held_out_before_px, d.decision.held_out_after_px, d.decision.reason);
  return text;
}

int count_usable(const std::vector<FrameResult>& results, std::size_t first, std::size_t last) {
  return static_cast<int>(
      std::count_if(results.begin(), results.end(), [first, last](const FrameResult& r) {
        return r.sample.frame >= first && r.sample.frame < last && usable(r.sample);
      }));
}

MotionError motion_error(const FrameResult& from, const FrameResult& to) {
  const Transform estimated = from.sample.T_world_left.inverse() * to.sample.T_world_left;
  const Transform real = from.T_reference_left.inverse() * to.T_reference_left;
  return {(estimated.t - real.t).norm(), log_so3(estimated.R * real.R.transpose()).norm()};
}

std::string false_ok(const std::vector<FrameResult>& results) {
  // Limits: 5 cm and 1.5 % of the path since then; rad.
  constexpr double kTranslation = 0.05, kPerMetre = 0.015, kRotation = 0.01;
  std::string worst;
  double worst_ratio = 1.0;
  const FrameResult* first = nullptr;
  const FrameResult* previous = nullptr;
  double path = 0;
  for (const FrameResult& r : results) {
    if (r.map_reset) first = nullptr;
    if (!usable(r.sample)) continue;
    if (first == nullptr) {
      first = previous = &r;
      path = 0;
      continue;
    }
    path += (r.T_reference_left.t - previous->T_reference_left.t).norm();
    previous = &r;
    const MotionError e = motion_error(*first, r);
    const double ratio =
        std::max(e.translation / (kTranslation + kPerMetre * path), e.rotation / kRotation);
    if (ratio <= worst_ratio) continue;
    worst_ratio = ratio;
    worst = fmt::format("frame {} is ok, but since frame {} ({:.2f} m) off by {:.3f} m, {:.4f} rad",
                        r.sample.frame, first->sample.frame, path, e.translation, e.rotation);
  }
  return worst;
}

TrajectoryEvaluation evaluate_results(const std::vector<FrameResult>& results,
                                      const std::vector<double>& lengths) {
  std::vector<StampedPose> estimate, truth;
  for (const FrameResult& r : results) {
    if (r.sample.status == PoseStatus::lost) continue;
    estimate.push_back({r.sample.stamp, r.sample.T_world_left});
    truth.push_back({r.sample.stamp, r.T_reference_left});
  }
  return evaluate(estimate, truth, {.segments = {{lengths, 1, false}}});
}

RigError rig_error(const RigCalibration& found, int k, const Transform& truth) {
  const auto c = static_cast<std::size_t>(k);
  RigError e;
  const Vec3 turn = log_so3(found.T_camera_left[c].R * truth.R.transpose());
  e.rotation = turn.cwiseAbs().maxCoeff();
  e.t = found.T_camera_left[c].t - truth.t;
  for (int i = 0; i < 6; ++i) {
    const double error = i < 3 ? turn[i] : e.t[i - 3],
                 sigma = found.sigma_noise[c][static_cast<std::size_t>(i)];
    if (i == 3 && k == 1) continue;
    e.sigmas = std::max(e.sigmas, std::abs(error) / sigma);
  }
  return e;
}

std::string to_string(const RigError& e) {
  return fmt::format("rotation {:.4f} mrad, t {:+.3f} {:+.3f} {:+.3f} mm, at most {:.2f} sigmas",
                     1e3 * e.rotation, 1e3 * e.t.x(), 1e3 * e.t.y(), 1e3 * e.t.z(), e.sigmas);
}

}  // namespace vergence::test
