#include <algorithm>
#include <array>
#include <cmath>

#include "core/calibration/rig_solver.hpp"

/// Conversion of an adjustment's result to a RigSolution.
namespace vergence::calibration {
namespace {

/// Replaces the sigmas of the intrinsics that were estimated.
Intrinsics with_sigmas(Intrinsics lens, const std::array<double, kIntrinsicsSize>& sigma) noexcept {
  for (std::size_t i = 0; i < sigma.size(); ++i)
    if (sigma[i] > 0) (i < 4 ? lens.sigma[i] : lens.distortion_sigma[i - 4]) = sigma[i];
  return lens;
}

}  // namespace

void RigSolver::describe(RigSolution* s) const noexcept {
  for (std::size_t i = 1; i < poses_.size(); ++i)
    s->travelled_m += (poses_[i].centre() - poses_[i - 1].centre()).norm();
  std::uint32_t last = ~0U;
  for (const BundleObservation& o : observations_) {
    if (o.point == last) continue;
    last = o.point;
    ++s->tracks;
    if ((poses_[o.pose] * points_[o.point]).z() < options_.near_baselines * s->rig.baseline)
      ++s->near;
  }
  s->observations = static_cast<int>(observations_.size());
}

double RigSolver::length_noise(const BundleResult& r) const noexcept {
  if (!r.has_pose_covariance) return 0;
  std::size_t first = r.pose;
  double driven = 0;
  for (; first > 0 && held_[first] == 0; --first)
    driven += (poses_[first].centre() - poses_[first - 1].centre()).norm();
  if (!(driven > 0)) return 0;
  // The pose's τ is in the axes of its own camera, and so is this direction.
  const Vec3 way = (poses_[r.pose] * poses_[first].inverse()).t.normalized();
  // Variance with inverse_sigma taken as true.
  const double believed = way.dot(r.pose_covariance.bottomRightCorner<3, 3>() * way);
  // The path length depends mainly on the yaw between the cameras, so it has the yaw's inflation.
  const double white = r.covariance_white[1](1, 1), clustered = r.covariance_noise[1](1, 1);
  const double inflation = white > 0 ? std::max(1.0, clustered / white) : 1.0;
  return std::sqrt(std::max(0.0, believed * r.sigma0_squared * inflation)) / driven;
}

void RigSolver::write_result(const BundleResult& r, RigSolution* s) const noexcept {
  // Scale error of the path from uncertain intrinsics: half of the relative error of the focal
  // lengths, and 0.31 % per mrad of error of the principal points.
  constexpr double kScaleByFocal = 0.5, kScaleByRadian = 3.1;
  RigCalibration& rig = s->rig;
  for (int k = 0; k < count_; ++k) {
    const auto c = static_cast<std::size_t>(k);
    const Intrinsics& lens = cameras_[c].intrinsics();
    rig.intrinsics[c] = with_sigmas(lens, r.intrinsics_sigma[c]);
    if (k == 0) continue;
    rig.T_camera_left[c] = {normalised(T_camera_left_[c].R), T_camera_left_[c].t};
    rig.covariance_total[c] = r.covariance_total[c];
    for (int i = 0; i < 6; ++i) {
      rig.sigma_noise[c][static_cast<std::size_t>(i)] =
          std::sqrt(std::max(0.0, r.covariance_noise[c](i, i)));
      rig.sigma_total[c][static_cast<std::size_t>(i)] =
          std::sqrt(std::max(0.0, r.covariance_total[c](i, i)));
    }
  }
  rig.covariance = r.covariance;
  rig.inflation = r.inflation;
  rig.frames = s->frames;
  rig.found = log_.frame(log_.size() - 1).stamp;
  rig.reprojection_px = r.rms_px;
  const double focal = options_.focal_sigma_percent * 0.01,
               centre = options_.principal_point_sigma_px / rig.intrinsics[0].fx;
  const double noise = length_noise(r);
  rig.scale_sigma = std::hypot(noise, std::hypot(kScaleByFocal * focal, kScaleByRadian * centre));
}

/// Runs the monitors over the frames used, with the result as the reference, to find a camera out
/// of sync or a change of the rig within the solve.
void RigSolver::watch_frames(RigSolution* s) noexcept {
  for (int k = 1; k < count_; ++k) {
    const Watch seen = watch_camera(k, s->rig);
    if (s->lag_frames == 0) s->lag_frames = seen.lag_frames;
    if (s->offset_frames == 0) s->offset_frames = seen.offset_frames;
    // All cameras have been in place since the latest change.
    s->changed_at = std::max(s->changed_at, seen.changed_at);
  }
}

RigSolver::Watch RigSolver::watch_camera(int k, const RigCalibration& rig) noexcept {
  Watch seen;
  const auto other = static_cast<std::size_t>(k);
  const Intrinsics &a = cameras_[0].intrinsics(), &b = cameras_[other].intrinsics();
  const Pinhole left{a.fx, a.fy, a.cx, a.cy}, right{b.fx, b.fy, b.cx, b.cy};
  if (!monitor_.set_reference(rig.T_camera_left[other], left, right, rig.covariance_total[other]))
    return seen;
  monitor_.expect_scatter(expected_scatter_px_);
  pairing_.reset();
  jumps_.set_reference(rig.T_camera_left[other], left, right);
  for (std::size_t i = 0; i < poses_.size(); ++i) {
    const LoggedFrame& f = log_.frame(logged_[i]);
    stereo_.clear();
    for (const LoggedObservation& observation : f.observations) {
      Vec3 l, r;
      if (!observation.by(0) || !observation.by(k) ||
          !cameras_[0].unproject(observed_pixel(observation, 0), &l) ||
          !cameras_[other].unproject(observed_pixel(observation, k), &r))
        continue;
      (void)stereo_.push(
          {Vec2(left.fx * l.x() / l.z() + left.cx, left.fy * l.y() / l.z() + left.cy),
           Vec2(right.fx * r.x() / r.z() + right.cx, right.fy * r.y() / r.z() + right.cy),
           static_cast<double>(observation.sigma), observation.track});
    }
    // The log contains moving frames only.
    MonitorFrame shown;
    shown.frame = f.number;
    shown.moving = true;
    shown.stereo = stereo_.span();
    if (i > 0) shown.T_now_before = poses_[i] * poses_[i - 1].inverse();
    const MonitorResult v = monitor_.update(shown);
    seen.offset_frames = v.offset_frames;
    pairing_.next(f.number, stereo_.span(), rig.T_camera_left[other], left, right);
    if (seen.lag_frames == 0) seen.lag_frames = pairing_.lag_frames();
    const DisparityJump jump = jumps_.next(f.number, stereo_.span(), shown.T_now_before);
    if (jump.confirmed) seen.changed_at = jump.onset_frame;
    if (v.kind == MonitorResult::Kind::knock) seen.changed_at = v.onset_frame;
  }
  return seen;
}

}  // namespace vergence::calibration
