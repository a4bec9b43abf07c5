#include "core/odometry/pose_estimator.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include "core/math/linear_solve.hpp"
#include "core/math/robust.hpp"

namespace vergence::odometry {
bool PoseFit::confirmed_stereo() const noexcept {
  return std::popcount(cameras) >= 2 && stereo >= kMajority * stereo_found;
}

PoseEstimator::PoseEstimator(const OdometryOptions& options, const RigCalibration& rig,
                             Arena& arena)
    : options_(options),
      rig_(rig),
      table_(kMaxPoints, arena),
      mlesac_(kMaxPoints, arena),
      refiner_(kMaxPoints, arena),
      owner_(arena.make<std::uint16_t>(kMaxPoints, "pose rows")),
      agrees_(arena.make<std::uint8_t>(kMaxPoints, "pose flags")),
      agrees_all_(arena.make<std::uint8_t>(kMaxPoints, "pose flags of all cameras")),
      random_(options.seed) {}

template <class CamerasOf>
void PoseEstimator::collect(const Map& map, const RigCalibration& rig, int first,
                            CamerasOf cameras_of) noexcept {
  table_.set_rig(rig);
  table_.clear();
  owner_.clear();
  const std::span<const MapPoint> points = map.points();
  for (std::size_t i = 0; i < points.size(); ++i) {
    const PointObservation& now = points[i].now;
    const std::uint8_t cameras = cameras_of(points[i]);
    if (cameras == 0) continue;
    if (!table_.push(points[i].p_world,
                     now.sigma[static_cast<std::size_t>(std::countr_zero(cameras))]))
      return;
    for (int k = 0; k < rig_.cameras; ++k)
      if (has_camera(cameras, k))
        table_.see(k - first, now.pixel[static_cast<std::size_t>(k)].cast<double>());
    (void)owner_.push(static_cast<std::uint16_t>(i));
  }
}

bool PoseEstimator::others_move(const Map& map, const Transform& T_left_world) noexcept {
  collect(map, rig_, 0, [](const MapPoint& p) noexcept {
    return p.now.cameras == 0 ? p.in_images : std::uint8_t{0};
  });
  const Solved s = solve(T_left_world, true);
  return s.inliers >= kCameraAlone && s.inliers > kRigidShare * static_cast<double>(owner_.size());
}

void PoseEstimator::collect_camera(const Map& map, int k) noexcept {
  RigCalibration one;
  one.cameras = 1;
  one.intrinsics[0] = rig_.intrinsics[static_cast<std::size_t>(k)];
  collect(map, one, k, [k](const MapPoint& p) noexcept {
    std::uint8_t cameras = 0;
    if (p.constrains_poses() && p.now.by(k)) add_camera(&cameras, k);
    return cameras;
  });
}

PoseEstimator::Solved PoseEstimator::solve(const Transform& start, bool sample,
                                           std::span<const std::uint8_t> used) noexcept {
  Solved s;
  if (table_.size() < 3) return s;
  s.T = start;
  if (sample) {
    const MlesacOptions how{.max_hypotheses = options_.mlesac_hypotheses};
    const MlesacPose m = mlesac_.solve(table_.view(), how, &start, random_);
    if (!m.found) return s;
    s.T = m.T_left_world;
  }
  // A sampled pose is rough, so its gross residuals are no outliers yet.
  const RefinedPose r =
      refiner_.refine(table_.view(), s.T, sample ? mlesac_.flags() : used, !sample);
  if (!r.usable) return s;
  s.found = true;
  s.T = r.T_left_world;
  s.rms_px = r.rms_px;
  s.scale = r.scale;
  s.inliers = r.inliers;
  // It stays zero if the observations do not determine the pose.
  if (const Cholesky<6> factor(r.information); factor.ok()) s.covariance = factor.inverse();
  return s;
}

void PoseEstimator::count(const Map& map, PoseFit* fit) const noexcept {
  std::array<int, kMaxCameras> held{};
  const std::span<const MapPoint> points = map.points();
  for (std::size_t i = 0; i < points.size(); ++i) {
    const MapPoint& p = points[i];
    if (!p.constrains_poses() || p.now.cameras == 0) continue;
    ++fit->given;
    if (std::popcount(p.now.cameras) > 1) ++fit->stereo_found;
    const std::uint8_t good = agrees_[i];
    if (good == 0) continue;
    ++fit->inliers;
    for (int k = 0; k < rig_.cameras; ++k)
      held[static_cast<std::size_t>(k)] += has_camera(good, k) ? 1 : 0;
    if ((good & 1U) == 0 || (good & ~1U) == 0) continue;
    ++fit->stereo;
    const double z = (fit->T_left_world * p.p_world).z();
    const auto other =
        static_cast<std::size_t>(std::countr_zero(static_cast<unsigned>(good & ~1U)));
    if (rig_.intrinsics[0].fx * rig_.T_camera_left[other].t.norm() > kNearDisparity * z)
      ++fit->near;
  }
  for (int k = 0; k < rig_.cameras; ++k)
    if (held[static_cast<std::size_t>(k)] >= kMinAgreeing) add_camera(&fit->cameras, k);
  // A single camera measures no depth and creates no points, so more inliers are required.
  fit->found = fit->inliers >=
               (std::popcount(fit->cameras) < 2 ? options_.ok_inliers : options_.min_inliers);
}

PoseFit PoseEstimator::fit_all(const Map& map, const Transform& start, bool sample,
                               bool left_only) noexcept {
  collect(map, rig_, 0, [](const MapPoint& p) noexcept {
    return p.constrains_poses() ? p.now.cameras : std::uint8_t{0};
  });
  PoseFit fit;
  fit.T_left_world = start;
  std::fill(agrees_.begin(), agrees_.end(), std::uint8_t{0});
  std::array<std::uint8_t, kMaxPoints> left;
  left.fill(1);
  const Solved s = solve(start, sample, std::span(left).first(left_only ? table_.size() : 0));
  if (s.found) {
    fit.T_left_world = s.T;
    fit.rms_px = s.rms_px;
    fit.scale = s.scale;
    fit.covariance = s.covariance;
    for (std::size_t i = 0; i < owner_.size(); ++i) agrees_[owner_[i]] = refiner_.flags()[i];
  }
  count(map, &fit);
  return fit;
}

PoseFit PoseEstimator::fit_linked(const Map& map, const Transform& start, bool sample) noexcept {
  return fit_all(map, start, sample, false);
}

PoseFit PoseEstimator::fit_left(const Map& map, const Transform& start) noexcept {
  Transform T;
  return fit_camera(map, 0, start, &T) ? fit_all(map, T, false, true) : PoseFit{};
}

PoseFit PoseEstimator::prefer_left(const Map& map, const Transform& start,
                                   const PoseFit& all) noexcept {
  std::swap(agrees_, agrees_all_);
  PoseFit left = fit_left(map, start);
  if (left.found && left.inliers >= options_.ok_inliers) return left;
  std::swap(agrees_, agrees_all_);
  return all;
}

bool PoseEstimator::supports_camera(const Solved& s) const noexcept {
  return s.inliers >= kCameraAlone &&
         s.inliers >= kChanceShare * static_cast<double>(owner_.size());
}

bool PoseEstimator::fit_camera(const Map& map, int k, const Transform& start,
                               Transform* T_camera_world) noexcept {
  collect_camera(map, k);
  const Solved s = solve(start, true);
  if (!supports_camera(s)) return false;
  *T_camera_world = s.T;
  return true;
}

PoseFit PoseEstimator::fit_unlinked(const Map& map, const Transform& start, bool sample,
                                    std::span<Transform> T_camera_left) noexcept {
  PoseFit fit;
  fit.T_left_world = start;
  std::fill(agrees_.begin(), agrees_.end(), std::uint8_t{0});
  double squares = 0;
  int cameras = 0;
  for (int k = 0; k < rig_.cameras; ++k) {
    const auto c = static_cast<std::size_t>(k);
    collect_camera(map, k);
    const Solved s = solve(T_camera_left[c] * (k == 0 ? start : fit.T_left_world), sample);
    if (!supports_camera(s)) {
      // The rig's pose needs the left camera's.
      if (k == 0) break;
      continue;
    }
    for (std::size_t i = 0; i < owner_.size(); ++i)
      if (refiner_.flags()[i] != 0) add_camera(&agrees_[owner_[i]], k);
    if (k == 0) {
      fit.T_left_world = s.T;
      fit.covariance = s.covariance;
    } else {
      T_camera_left[c] = s.T * fit.T_left_world.inverse();
    }
    squares += s.rms_px * s.rms_px;
    ++cameras;
  }
  fit.rms_px = cameras == 0 ? 0.0 : std::sqrt(squares / cameras);
  count(map, &fit);
  if (!has_camera(fit.cameras, 0)) fit.found = false;
  return fit;
}

}  // namespace vergence::odometry
