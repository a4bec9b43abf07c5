#include "core/estimator/rig_monitor.hpp"

#include <algorithm>
#include <cmath>

#include "core/calibration/gates.hpp"
#include "core/calibration/posterior.hpp"

namespace vergence {
namespace {

using calibration::MonitorResult;
using odometry::MapPoint;

// Sigmas of a verified calibration solved from images: the residual lens error in one stretch. The
// solve's own sigmas do not apply, because it determines rotations and principal points only
// together.
constexpr std::array kVerifiedSigmas = {2e-4, 5e-4, 2e-4, 0.003, 0.003, 0.006};

/// Covariance of a reference with a baseline of `length` metres. Unless it was solved from images
/// and verified it is wide, so that only a change against earlier frames counts as a knock.
Mat6 reference_covariance(bool solved_and_verified, double length) noexcept {
  Vec6 spread = Vec6::Constant(calibration::kUnknownTransform);
  if (solved_and_verified) spread = Eigen::Map<const Vec6>(kVerifiedSigmas.data());
  spread.tail<3>() *= length;
  return spread.cwiseAbs2().asDiagonal();
}

/// A rotation by σ about the axis that epipolar lines do not show moves all points by f σ.
ChangeEvidence to_evidence(const calibration::DisparityJump& jump, double focal_px) noexcept {
  const double sigmas = jump.px / jump.sigma_px, px = std::abs(jump.px);
  return {0.5 * sigmas * sigmas, px, 1e3 * px / focal_px};
}

/// True if the left camera and camera k gave structured images.
bool both_show(const odometry::FrameOutcome& outcome, std::size_t k) noexcept {
  return (outcome.structured & 1U) != 0 && ((outcome.structured >> k) & 1U) != 0;
}

/// Number of points that camera k should show at this pose.
int expected_stereo(const odometry::Odometry& odometry, std::size_t k,
                    const Transform& T_camera_world) noexcept {
  return static_cast<int>(std::ranges::count_if(odometry.map().points(), [&](const MapPoint& p) {
    return p.stage == odometry::PointStage::active && p.now.by(0) &&
           odometry.in_view(static_cast<int>(k), T_camera_world * p.p_world);
  }));
}

}  // namespace

RigMonitor::RigMonitor(const calibration::MonitorOptions& options, int cameras,
                       std::size_t capacity, Arena& arena)
    : options_(options) {
  for (std::size_t k = 1; k < static_cast<std::size_t>(cameras); ++k)
    (void)monitors_.push({.k = k,
                          .monitor = calibration::Monitor(options, arena),
                          .jumps = calibration::DisparityJumpDetector(capacity, arena),
                          .pairing = calibration::PairingEvidence(capacity, arena)});
  stereo_ = BoundedVector<calibration::StereoObservation>(
      arena.make<calibration::StereoObservation>(capacity, "monitored matches"));
}

void RigMonitor::watch(const RigCalibration& rig, bool solved_and_verified) noexcept {
  solved_and_verified_ = solved_and_verified;
  expect_scatter(solved_and_verified ? options_.verified_bias_px : options_.unverified_bias_px);
  for (CameraMonitors& w : monitors_) {
    w.pair = calibration::stereo_pair(rig, w.k);
    (void)w.monitor.set_reference(
        w.pair, reference_covariance(solved_and_verified, w.pair.T_camera_left.t.norm()));
    // Before the spread of matches is known, a result makes poses `degraded` and raises no knock.
    w.grace = kMinForMean - 1;
  }
}

void RigMonitor::map_rebuilt(const odometry::Map& map, const RigCalibration& rig,
                             bool solved_and_verified) noexcept {
  map_rebuild_pending_ = false;
  watch(rig, solved_and_verified);
  for (CameraMonitors& w : monitors_) w.pairing.reset();
  map_rebuilt(map);
}

/// The next frame is compared with the points created in this one.
void RigMonitor::map_rebuilt(const odometry::Map& map) noexcept {
  for (CameraMonitors& w : monitors_) {
    // The next frame differs from a distorted one without a change of the rig.
    if (w.distorted) {
      w.jumps.set_reference(w.pair);
      continue;
    }
    (void)collect_stereo(map, w.k, 1);
    w.jumps.rebase(w.pair, stereo_.span());
  }
}

void RigMonitor::begin_unlinked(const RigCalibration& rig) noexcept {
  T_left_world_before_.reset();
  map_rebuild_pending_ = false;
  for (CameraMonitors& w : monitors_) w.T_camera_left_before = rig.T_camera_left[w.k];
  set_jump_reference(rig);
}

void RigMonitor::map_lost() noexcept {
  T_left_world_before_.reset();
  reset();
  for (CameraMonitors& w : monitors_) {
    w.jumps.reset();
    w.pairing.reset();
  }
}

Transform RigMonitor::step_to(const Transform& T_left_world) noexcept {
  Transform step =
      T_left_world_before_ ? T_left_world * T_left_world_before_->inverse() : Transform{};
  T_left_world_before_ = T_left_world;
  return step;
}

int RigMonitor::collect_stereo(const odometry::Map& map, std::size_t k, int min_found) noexcept {
  stereo_.clear();
  int found = 0;
  for (const MapPoint& p : map.points()) {
    if (!p.followed() || p.found < min_found || !p.now.by(0)) continue;
    if (((p.in_images >> k) & 1U) == 0) continue;
    if (p.stage == odometry::PointStage::active) ++found;
    (void)stereo_.push({p.now.pixel[0].cast<double>(), p.now.pixel[k].cast<double>(),
                        static_cast<double>(std::max(p.now.sigma[0], p.now.sigma[k])), p.id});
  }
  return found;
}

std::optional<std::uint64_t> RigMonitor::update_unlinked(const odometry::Odometry& odometry,
                                                         const odometry::FrameOutcome& outcome,
                                                         std::uint64_t number) noexcept {
  std::optional<std::uint64_t> onset;
  const bool first = outcome.initialised || outcome.restarted;
  if (first) T_left_world_before_.reset();
  const Transform step = step_to(outcome.T_left_world);
  for (CameraMonitors& w : monitors_) {
    if (first) w.jumps.reset();
    if (!both_show(outcome, w.k)) {
      w.jumps.skip(step);
      continue;
    }
    (void)collect_stereo(odometry.map(), w.k, odometry::kMinFound);
    w.jumps.set_transform(w.T_camera_left_before);
    const calibration::DisparityJump jump = w.jumps.next(number, stereo_.span(), step);
    if (jump.confirmed && !w.pairing.questioned())
      onset = std::min(onset.value_or(jump.onset_frame), jump.onset_frame);
    w.T_camera_left_before = odometry.rig().T_camera_left[w.k];
  }
  return onset;
}

RigAssessment RigMonitor::update(const odometry::Odometry& odometry,
                                 const odometry::FrameOutcome& outcome, std::uint64_t number,
                                 bool moving, bool verified) noexcept {
  RigAssessment rig;
  rig.cameras_in_sync = true;
  const Transform step = step_to(outcome.T_left_world);
  for (CameraMonitors& w : monitors_) {
    const int found = collect_stereo(odometry.map(), w.k, odometry::kMinFound);
    calibration::PairingEvidence& pairing = w.pairing;
    const double before = pairing.distance_px();
    pairing.next(number, stereo_.span(), w.pair);
    rig.cameras_in_sync = rig.cameras_in_sync && pairing.cameras_in_sync();
    if (pairing.lag_frames() != 0) rig.lag_frames = pairing.lag_frames();
    rig.margins.lag = std::max(rig.margins.lag, pairing.lag_margin());

    // A pose biased by a distorted image changes the disparities of the frames before and after it.
    w.distorted = pairing.distance_px() > calibration::kMaxFitPx &&
                  pairing.distance_px() > kUnusualRatio * before;
    calibration::DisparityJump jump;
    if (both_show(outcome, w.k) && !w.distorted)
      jump = w.jumps.next(number, stereo_.span(), step);
    else
      w.jumps.skip(step);

    MonitorResult v;
    if (!map_rebuild_pending_) v = update_monitor(odometry, outcome, number, found, moving, &w);
    add_to_assessment(w, v, jump, verified, &rig);
  }
  return rig;
}

MonitorResult RigMonitor::update_monitor(const odometry::Odometry& odometry,
                                         const odometry::FrameOutcome& outcome,
                                         std::uint64_t number, int found, bool moving,
                                         CameraMonitors* w) noexcept {
  calibration::MonitorFrame f;
  f.frame = number;
  f.moving = moving;
  f.stereo = stereo_.span();
  if (outcome.images_good)
    f.expected_stereo =
        expected_stereo(odometry, w->k, w->pair.T_camera_left * outcome.T_left_world);
  f.found_stereo = found;
  MonitorResult v = w->monitor.update(f);
  if (w->grace > 0) {
    --w->grace;
    // A wrong new reference is not a knock, but no pose based on it is `ok`.
    const bool suspect =
        solved_and_verified_ && (v.undecided || v.kind != MonitorResult::Kind::quiet ||
                                 w->pairing.distance_px() > calibration::kMaxFitPx);
    v = MonitorResult{};
    v.undecided = suspect;
  }
  return v;
}

void RigMonitor::add_to_assessment(const CameraMonitors& w, MonitorResult v,
                                   const calibration::DisparityJump& jump, bool verified,
                                   RigAssessment* rig) const noexcept {
  using Kind = MonitorResult::Kind;
  // A lag moves matches off the epipolar lines, and changes disparities whenever the speed changes.
  // So no change of the rig is reported while cameras may be out of sync.
  const bool may_lag = w.pairing.suspected() || w.pairing.questioned();
  // One frame over the threshold decides nothing until the next one confirms it.
  if (!v.undecided && !may_lag)
    rig->margins.change = std::max(rig->margins.change, v.statistic / options_.threshold);
  const bool change = v.kind == Kind::knock || v.kind == Kind::drift;
  if (may_lag || (!verified && change)) {
    v.undecided = v.undecided || v.kind != Kind::quiet || w.pairing.suspected();
    v.kind = Kind::quiet;
  }
  if (jump.confirmed && may_lag) {
    v.undecided = true;
  } else if (jump.confirmed && v.kind < Kind::knock) {
    v.kind = Kind::knock;
    v.onset_frame = jump.onset_frame;
    v.evidence = to_evidence(jump, w.pair.camera.fx);
  }
  rig->margins.jump = std::max(rig->margins.jump, jump.over_limit);
  rig->undecided = rig->undecided || v.undecided || jump.suspected;
  if (v.kind > rig->change.kind) rig->change = v;
}

}  // namespace vergence
