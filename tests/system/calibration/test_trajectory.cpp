#include "tests/system/calibration/test_trajectory.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <optional>

#include <fmt/format.h>

#include "app/runtime/background_thread.hpp"
#include "core/memory/allocation_guard.hpp"

namespace vergence::test {

RigCalibration nominal_of(const RigCalibration& rig) {
  RigCalibration n = rig;
  for (int k = 1; k < rig.cameras; ++k) {
    const auto c = static_cast<std::size_t>(k);
    n.T_camera_left[c] = {Mat3::Identity(), Vec3(-rig.T_camera_left[c].t.norm(), 0, 0)};
  }
  return n;
}

CourseSetting from_scratch(const RigCalibration& rig) {
  CourseSetting s;
  s.options.trust = CalibrationTrust::none;
  s.options.calibration.intrinsics = calibration::IntrinsicsEstimation::fixed;
  s.given = rig;
  for (Transform& T : s.given.T_camera_left) T = {};
  s.nominal = nominal_of(rig);
  return s;
}

CourseSetting with_calibration(const RigCalibration& rig) {
  CourseSetting s;
  s.options.calibration.intrinsics = calibration::IntrinsicsEstimation::fixed;
  s.given = rig;
  for (std::size_t k = 1; k < static_cast<std::size_t>(rig.cameras); ++k)
    s.given.sigma_noise[k] = s.given.sigma_total[k] = {2e-5, 3e-5, 2e-5, 1e-5, 4e-4, 7e-4};
  s.nominal = nominal_of(rig);
  return s;
}

struct Course::Parts {
  explicit Parts(const CourseSetting& s) : arena(Estimator::memory_needed(s.options, s.given)) {
    if (s.threads > 1) {
      two.emplace();
      beside.emplace();
    }
    estimator.emplace(s.options, s.given, s.nominal, arena,
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

Course::Course(const CourseSetting& setting)
    : parts_(std::make_unique<Parts>(setting)),
      allocations_before_(AllocationGuard::runtime_allocations()) {}
Course::~Course() = default;
const Estimator& Course::estimator() const noexcept { return *parts_->estimator; }

void Course::note(std::uint64_t frame) {
  for (const EstimatorEvent& e : parts_->estimator->events()) events_.push_back({frame, e});
  for (const CalibrationDecision& d : parts_->estimator->calibrations())
    if (!d.is_refinement) decisions_.push_back({frame, d});
}

void Course::give(const RigFrame& frame, const Transform& T_reference_left) {
  Answer a;
  {
    const SealedScope sealed;
    a.sample = parts_->estimator->process(frame);
  }
  a.T_reference_left = T_reference_left;
  for (const EstimatorEvent& e : parts_->estimator->events())
    a.restarted = a.restarted || e.kind == EstimatorEvent::Kind::map_reset;
  answers_.push_back(a);
  last_ = frame.number;
  note(frame.number);
}

void Course::give(const StereoDrive& drive, std::size_t first, std::size_t last, const Edit& edit) {
  for (std::size_t i = first; i < std::min(last, drive.size()); ++i) {
    RigFrame frame;
    frame.number = i;
    frame.stamp = drive.stamps[i];
    frame.cameras = 2;
    for (std::size_t k = 0; k < 2; ++k) frame.images[k] = drive.pairs[i][k].view();
    if (edit && !edit(i, &frame)) continue;
    give(frame, drive.truth[i]);
  }
}

std::uint64_t Course::allocations() const noexcept {
  return AllocationGuard::runtime_allocations() - allocations_before_;
}

void Course::finish() {
  parts_->estimator->finish();
  note(last_);
}

const CalibrationDecision* Course::accepted() const noexcept {
  for (auto d = decisions_.rbegin(); d != decisions_.rend(); ++d)
    if (d->decision.accepted) return &d->decision;
  return nullptr;
}

int Course::count_accepted() const noexcept {
  return static_cast<int>(std::count_if(decisions_.begin(), decisions_.end(),
                                        [](const Decided& d) { return d.decision.accepted; }));
}

const TimedEvent* Course::first(EstimatorEvent::Kind kind) const noexcept {
  const auto found = std::find_if(events_.begin(), events_.end(),
                                  [kind](const TimedEvent& t) { return t.event.kind == kind; });
  return found == events_.end() ? nullptr : &*found;
}

bool Course::rejected_for(const std::string& reason) const noexcept {
  return std::any_of(decisions_.begin(), decisions_.end(), [&](const Decided& d) {
    return !d.decision.accepted && reason == d.decision.reason;
  });
}

std::string Course::story() const {
  std::string text = test::story(answers_);
  for (const TimedEvent& t : events_)
    text += fmt::format("frame {}: {} ({:.3g})\n", t.frame, t.event.why, t.event.value);
  for (const Decided& d : decisions_)
    text +=
        fmt::format("frame {}: {} from {} frames, {:.3f} px, held out {:.3f} to {:.3f} px {}\n",
                    d.frame, d.decision.accepted ? "accepted" : "rejected",
                    d.decision.calibration.frames, d.decision.calibration.reprojection_px,
                    d.decision.held_out_before_px, d.decision.held_out_after_px, d.decision.reason);
  return text;
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

StereoDrive film(const RenderedDriveOptions& options, std::size_t frames) {
  StereoDrive out;
  out.rig = options.rig;
  RenderedDrive drive(options);
  for (std::size_t i = 0; i < frames; ++i) {
    const RigFrame& frame = drive.frame(i);
    std::array<OwnedImage, 2> pair;
    for (std::size_t k = 0; k < 2; ++k) {
      const ImageView& view = frame.images[k];
      pair[k] = OwnedImage(view.width, view.height);
      for (int y = 0; y < view.height; ++y)
        std::memcpy(pair[k].bytes.data() + y * pair[k].stride, view.row(y),
                    static_cast<std::size_t>(view.width));
    }
    out.stamps.push_back(frame.stamp);
    out.pairs.push_back(std::move(pair));
    out.truth.push_back(drive.T_enu_left(i));
  }
  return out;
}

}  // namespace vergence::test
