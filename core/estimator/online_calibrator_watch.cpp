#include <algorithm>
#include <array>
#include <limits>

#include "core/estimator/online_calibrator.hpp"

/// What OnlineCalibrator sees of the rig frame by frame: monitors and disparities.
namespace vergence {
namespace {

using calibration::MonitorVerdict;
using odometry::MapPoint;

constexpr double kImageMargin = 12.0;  // px: nearer to the edge a track need not be found
// Sigmas of the reference while a calibration is a claim: of rotation (rad), and of t in baselines.
// What is off from the first frame is a calibration that does not fit, no knock; only a change is
// one.
constexpr std::array kClaimed = {0.05, 0.05, 0.05, 0.1, 0.1, 0.1};
// And of one that the drive has confirmed, until the monitor has measured its own: what the lens
// model leaves in one stretch.
constexpr std::array kConfirmed = {2e-4, 5e-4, 2e-4, 0.003, 0.003, 0.006};
constexpr double kLearnedCovariance =
    1.5;                     // times the monitor's own: the scene it was measured in was one
constexpr int kWitness = 2;  // frames: a point just made was sought in the band of the calibration
                             // in use
constexpr int kGraceFrames =
    5;  // after a new reference: the monitor does not yet know how far matches spread
constexpr int kLearnFrames = 45;  // moving, in agreement

Mat6 reference_covariance(const std::array<double, 6>& sigma, double baseline) noexcept {
  Vec6 spread = Eigen::Map<const Vec6>(sigma.data());
  spread.tail<3>() *= baseline;
  return spread.cwiseAbs2().asDiagonal();
}

int rank(MonitorVerdict::Kind kind) noexcept {
  using K = MonitorVerdict::Kind;
  switch (kind) {
    case K::quiet:
      return 0;
    case K::out_of_step:
      return 1;
    case K::drift:
      return 2;
    case K::knock:
      return 3;
    case K::collapse:
      return 4;
  }
  return 0;
}

}  // namespace

void OnlineCalibrator::watch_calibration() noexcept {
  for (int k = 1; k < rig_.cameras; ++k) {
    const auto c = static_cast<std::size_t>(k);
    learning_[c] = true;
    monitors_[c]->expect_scatter(verified_ ? options_.monitor.found_bias_px
                                           : options_.monitor.claimed_bias_px);
    watch_against(
        k, rig_.T_camera_left[c],
        reference_covariance(verified_ ? kConfirmed : kClaimed, rig_.T_camera_left[c].t.norm()));
  }
}

Pinhole OnlineCalibrator::pinhole(std::size_t c) const noexcept {
  const Intrinsics& lens = rig_.intrinsics[c];
  return {lens.fx, lens.fy, lens.cx, lens.cy};
}

void OnlineCalibrator::watch_against(int k, const Transform& T_camera_left,
                                     const Mat6& covariance) noexcept {
  const auto c = static_cast<std::size_t>(k);
  (void)monitors_[c]->set_reference(T_camera_left, pinhole(0), pinhole(c), covariance);
  feeds_[c]->reset();
  grace_[c] = kGraceFrames;
}

void OnlineCalibrator::learn_reference(int k, const MonitorVerdict& verdict) noexcept {
  const auto c = static_cast<std::size_t>(k);
  if (!learning_[c] || verdict.kind != MonitorVerdict::Kind::quiet ||
      monitors_[c]->frames_agreed() < kLearnFrames)
    return;
  learning_[c] = false;
  const double length = rig_.T_camera_left[c].t.norm();
  Transform measured =
      perturbed(rig_.T_camera_left[c], verdict.offset.head<3>(), verdict.offset.tail<3>());
  measured.t *= length / measured.t.norm();
  watch_against(k, measured, kLearnedCovariance * verdict.covariance);
}

void OnlineCalibrator::scene_rebuilt(const odometry::Odometry& odometry) noexcept {
  relink_pending_ = false;
  watch_calibration();
  // Points made in this frame are where the next begins: no frame is between two that are compared.
  for (int k = 1; k < rig_.cameras; ++k) {
    const auto c = static_cast<std::size_t>(k);
    (void)collect_stereo(odometry.map(), k, 1);
    jumps_[c]->rebase(rig_.T_camera_left[c], pinhole(0), pinhole(c), stereo_.span());
  }
}

int OnlineCalibrator::frames_agreed() const noexcept {
  int least = std::numeric_limits<int>::max();
  for (int k = 1; k < rig_.cameras; ++k)
    least = std::min(least, monitors_[static_cast<std::size_t>(k)]->frames_agreed());
  return least;
}

int OnlineCalibrator::expected_stereo(const odometry::Odometry& odometry, int k,
                                      const Transform& T_left_world) const noexcept {
  const Transform T = rig_.T_camera_left[static_cast<std::size_t>(k)] * T_left_world;
  const Camera& camera = odometry.front_end().lens(k).raw();
  int n = 0;
  for (const MapPoint& p : odometry.map().points()) {
    Vec2 at;
    if (p.stage == odometry::PointStage::active && p.now.by(0) &&
        camera.project(T * p.p_world, &at, nullptr) == ProjectStatus::ok &&
        camera.inside(at, kImageMargin))
      ++n;
  }
  return n;
}

Transform OnlineCalibrator::step_to(const Transform& T_left_world) noexcept {
  const Transform step = any_ ? T_left_world * T_left_world_.inverse() : Transform{};
  T_left_world_ = T_left_world;
  any_ = true;
  return step;
}

int OnlineCalibrator::collect_stereo(const odometry::Map& map, int k, int least_found) noexcept {
  const auto c = static_cast<std::size_t>(k);
  stereo_.clear();
  int found = 0;
  for (const MapPoint& p : map.points()) {
    if (!p.followed() || p.found < least_found || !p.now.by(0)) continue;
    if (((p.in_images >> static_cast<unsigned>(k)) & 1U) == 0) continue;
    if (p.stage == odometry::PointStage::active) ++found;
    (void)stereo_.push({p.now.pixel[0].cast<double>(), p.now.pixel[c].cast<double>(),
                        static_cast<double>(std::max(p.now.sigma[0], p.now.sigma[c])), p.id});
  }
  return found;
}

std::optional<std::uint64_t> OnlineCalibrator::watch_sought(const odometry::Odometry& odometry,
                                                            const odometry::FrameOutcome& outcome,
                                                            std::uint64_t number) noexcept {
  std::optional<std::uint64_t> onset;
  const bool first = outcome.initialised || outcome.restarted;
  if (first) any_ = false;
  const Transform step = step_to(outcome.T_left_world);
  for (int k = 1; k < rig_.cameras; ++k) {
    const auto c = static_cast<std::size_t>(k);
    if (first) jumps_[c]->reset();
    (void)collect_stereo(odometry.map(), k, kWitness);
    jumps_[c]->set_transform(T_camera_left_before_[c]);
    const calibration::DisparityJump jump = jumps_[c]->next(number, stereo_.span(), step);
    if (jump.confirmed) onset = std::min(onset.value_or(jump.onset_frame), jump.onset_frame);
  }
  T_camera_left_before_ = odometry.rig().T_camera_left;
  return onset;
}

MonitorVerdict OnlineCalibrator::watch(const odometry::Odometry& odometry,
                                       const odometry::FrameOutcome& outcome,
                                       const RigFrame& frame) noexcept {
  MonitorVerdict worst;
  bool in_step = true;
  const Transform step = step_to(outcome.T_left_world);
  for (int k = 1; k < rig_.cameras; ++k) {
    const auto c = static_cast<std::size_t>(k);
    const int found = collect_stereo(odometry.map(), k, kWitness);
    const calibration::DisparityJump jump = jumps_[c]->next(frame.number, stereo_.span(), step);
    if (relink_pending_) {
      // The monitors wait for the scene of the calibration that they are to watch.
      worst.undecided = worst.undecided || jump.suspected;
      in_step = false;
      if (jump.confirmed) {
        worst.kind = MonitorVerdict::Kind::knock;
        worst.onset_frame = jump.onset_frame;
      }
      continue;
    }
    calibration::MonitorFrame f = feeds_[c]->next(frame.stamp, frame.number, stereo_.span(), step);
    f.expected_stereo =
        outcome.images_good ? expected_stereo(odometry, k, outcome.T_left_world) : 0;
    f.found_stereo = found;
    MonitorVerdict v = monitors_[c]->look(f);
    if (grace_[c] > 0) {
      --grace_[c];
      v = MonitorVerdict{};
    }
    in_step = in_step && v.in_step;
    learn_reference(k, v);
    if (jump.confirmed && rank(v.kind) < rank(MonitorVerdict::Kind::knock)) {
      v.kind = MonitorVerdict::Kind::knock;
      v.onset_frame = jump.onset_frame;
    }
    v.undecided = v.undecided || jump.suspected;
    if (rank(v.kind) > rank(worst.kind) ||
        (rank(v.kind) == rank(worst.kind) && (v.undecided || v.statistic > worst.statistic)))
      worst = v;
  }
  worst.in_step = in_step;
  return worst;
}

}  // namespace vergence
