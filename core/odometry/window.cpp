#include "core/odometry/window.hpp"

#include <algorithm>

#include "core/calibration/health.hpp"
#include "core/math/robust.hpp"
#include "core/odometry/undistorted_camera.hpp"

namespace vergence::odometry {
namespace {

// Average number of observations per point over all cameras; more are left out.
constexpr std::size_t kObservationsAPoint = 10;
// Limit of the squared whitened residual with 2 degrees of freedom; Gaussian errors exceed it with
// 3e-4.
constexpr float kOutlier = 16.F;
// Minimum number of observations that determine a pose.
constexpr int kObservationsOfPose = 3;
// Sigma in rad and m of rig parameters that a window does not estimate.
constexpr double kHeldSigma = 1e-6;
// Inflation of a variance: an unmodelled lens field of 0.03 px does not average out over 2000
// observations of 0.15 px.
constexpr double kInflation = 100.0;

}  // namespace

BundleCapacities WindowAdjuster::capacities(const OdometryOptions& options,
                                            const RigCalibration& rig) noexcept {
  BundleCapacities c;
  c.cameras = static_cast<std::size_t>(rig.cameras);
  c.poses = static_cast<std::size_t>(options.window_keyframes * rig.cameras);
  // At most half of the map's points are old enough to be seen by two keyframes.
  c.points = kMaxPoints / 2;
  c.observations = c.points * kObservationsAPoint;
  c.shared = options.extrinsic_rotation_sigma_rad > 0;
  return c;
}

WindowAdjuster::WindowAdjuster(const OdometryOptions& options, const RigCalibration& rig,
                               Arena& arena, PairRunner& runner)
    : options_(options), rig_(rig), adjuster_(capacities(options, rig), arena, &runner) {
  const BundleCapacities c = capacities(options, rig);
  points_ = BoundedVector<Vec3>(arena.make<Vec3>(c.points, "window points"));
  owner_ = BoundedVector<std::uint16_t>(arena.make<std::uint16_t>(c.points, "window points"));
  observations_ = BoundedVector<BundleObservation>(
      arena.make_unset<BundleObservation>(c.observations, "window observations"));
  residuals_ = arena.make<float>(c.observations, "window residuals");
  adopt_rig();
}

void WindowAdjuster::adopt_rig() noexcept {
  for (int k = 0; k < rig_.cameras; ++k)
    cameras_[static_cast<std::size_t>(k)] =
        UndistortedCamera(rig_.intrinsics[static_cast<std::size_t>(k)]).ideal();
  T_camera_left_ = rig_.T_camera_left;
  set_rotation_prior();
}

void WindowAdjuster::set_rotation_prior() noexcept {
  rotations_free_ = options_.extrinsic_rotation_sigma_rad > 0;
  if (!rotations_free_) return;
  prior_rig_ = rig_;
  prior_rig_.covariance = {};
  for (int k = 1; k < rig_.cameras; ++k) {
    const Vec3& t = rig_.T_camera_left[static_cast<std::size_t>(k)].t;
    // A rotation about the axis orthogonal to baseline and view shifts all disparities equally.
    const Vec3 axis = Vec3::UnitZ().cross(t);
    if (!(axis.norm() > kHeldSigma)) {
      rotations_free_ = false;
      return;
    }
    // A rotation by σ is a disparity of f σ, and so a relative depth error of z σ / b.
    const double known = 0.01 *
                         calibration::depth_error_percent(rig_, k, calibration::kRatingDepth) *
                         t.norm() / calibration::kRatingDepth;
    const double sigma = known > 0 ? std::min(known, options_.extrinsic_rotation_sigma_rad)
                                   : options_.extrinsic_rotation_sigma_rad;
    const Mat3 turn = sigma * sigma * axis.normalized() * axis.normalized().transpose() +
                      kHeldSigma * kHeldSigma * Mat3::Identity();
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j <= i; ++j)
        prior_rig_.covariance.set(extrinsic_row(k) + i, extrinsic_row(k) + j, turn(i, j));
      prior_rig_.covariance.set(extrinsic_row(k) + 3 + i, extrinsic_row(k) + 3 + i,
                                kHeldSigma * kHeldSigma);
    }
  }
}

void WindowAdjuster::gather(Map& map, bool linked, const FrameWorkload& effort) noexcept {
  poses_.clear();
  constant_.clear();
  points_.clear();
  owner_.clear();
  observations_.clear();
  // Number of poses per keyframe.
  const int images = linked ? 1 : rig_.cameras;
  oldest_ = map.order().size() - std::min<std::size_t>(map.order().size(), effort.window_keyframes);
  for (std::size_t i = oldest_; i < map.order().size(); ++i) {
    const Keyframe& keyframe = map.keyframe(map.order()[i]);
    for (int k = 0; k < images; ++k) {
      (void)poses_.push(linked ? keyframe.T_left_world
                               : keyframe.T_camera_left[static_cast<std::size_t>(k)] *
                                     keyframe.T_left_world);
      (void)constant_.push(i == oldest_ ? 1 : 0);
    }
  }
  const std::span<MapPoint> all = map.points();
  for (std::size_t i = 0; i < all.size(); ++i) {
    const MapPoint& p = all[i];
    if (!p.constrains_poses()) continue;
    const std::size_t first = observations_.size();
    int keyframes = 0;
    bool fits = !points_.full();
    for (std::size_t frame = oldest_; frame < map.order().size() && fits; ++frame) {
      const PointObservation& s = p.seen[map.order()[frame]];
      if (s.cameras == 0) continue;
      ++keyframes;
      for (int k = 0; k < rig_.cameras && fits; ++k) {
        if (!s.by(k)) continue;
        const auto c = static_cast<std::size_t>(k);
        const std::size_t pose =
            linked ? frame - oldest_ : (frame - oldest_) * static_cast<std::size_t>(images) + c;
        const Vec3 here = poses_[pose] * p.p_world;
        if ((linked ? rig_.T_camera_left[c] * here : here).z() < kMinDepth) continue;
        BundleObservation o;
        o.point = static_cast<std::uint32_t>(points_.size());
        o.pose = static_cast<std::uint16_t>(pose);
        o.camera = static_cast<std::uint8_t>(k);
        o.inverse_sigma = 1.F / s.sigma[c];
        o.x = s.pixel[c].x();
        o.y = s.pixel[c].y();
        fits = observations_.push(o);
      }
    }
    // A point seen from one place only does not constrain poses.
    if (!fits || keyframes < 2 || observations_.size() - first < 2) {
      observations_.truncate(first);
      continue;
    }
    (void)points_.push(p.p_world);
    (void)owner_.push(static_cast<std::uint16_t>(i));
  }
  // An image with too few observations keeps its pose.
  std::array<int, kMaxWindow * kMaxCameras> seen{};
  for (const BundleObservation& o : observations_) ++seen[o.pose];
  for (std::size_t i = 0; i < poses_.size(); ++i)
    if (seen[i] < kObservationsOfPose) constant_[i] = 1;
}

int WindowAdjuster::drop_outliers(Map& map) noexcept {
  int dropped = 0;
  for (std::size_t i = 0; i < observations_.size(); ++i) {
    if (!(residuals_[i] > kOutlier)) continue;
    const BundleObservation& o = observations_[i];
    MapPoint& p = map.points()[owner_[o.point]];
    const std::size_t images = poses_.size() / (map.order().size() - oldest_);
    p.seen[map.order()[oldest_ + o.pose / images]].drop(o.camera);
    ++dropped;
  }
  return dropped;
}

WindowOutcome WindowAdjuster::solve(bool linked, const FrameWorkload& effort) noexcept {
  WindowOutcome outcome;
  outcome.observations = static_cast<int>(observations_.size());
  if (poses_.size() < 2 || points_.empty()) return outcome;
  T_camera_left_ = rig_.T_camera_left;
  const auto n = static_cast<std::size_t>(rig_.cameras);
  BundleProblem problem;
  problem.cameras = std::span(cameras_).first(n);
  problem.T_camera_left = std::span(T_camera_left_).first(n);
  problem.T_left_world = poses_.span();
  problem.pose_constant = constant_.span();
  problem.points = points_.span();
  problem.observations = observations_.span();
  problem.squared_residuals = residuals_.first(observations_.size());
  BundleOptions how;
  how.configuration = !linked           ? BundleConfiguration::parallel_monocular
                      : rotations_free_ ? BundleConfiguration::stereo_calibration
                                        : BundleConfiguration::stereo_odometry;
  how.loss = BundleLoss::huber;
  how.loss_threshold = kHuber;
  how.max_steps = std::min<int>(options_.window_steps, effort.window_steps);
  // A remaining error of this many sigmas increases the pose's error by 5 %.
  how.tolerance_sigmas = 0.3;
  // The window starts near its optimum, so less damping than the default saves a step.
  how.initial_damping = 1e-6;
  if (how.configuration == BundleConfiguration::stereo_calibration)
    how.shared_prior = {&prior_rig_, kInflation};
  const BundleResult result = adjuster_.solve(problem, how);
  outcome.usable = result.usable();
  outcome.steps = result.steps;
  return outcome;
}

WindowOutcome WindowAdjuster::adjust(Map& map, bool linked, const FrameWorkload& effort) noexcept {
  gather(map, linked, effort);
  WindowOutcome outcome = solve(linked, effort);
  if (!outcome.usable) return outcome;
  const std::size_t images = linked ? 1 : static_cast<std::size_t>(rig_.cameras);
  for (std::size_t i = 0; oldest_ + i < map.order().size(); ++i) {
    Keyframe& keyframe = map.keyframe(map.order()[oldest_ + i]);
    const Transform& left = poses_[i * images];
    keyframe.T_left_world = {normalised(left.R), left.t};
    for (std::size_t k = 1; k < images; ++k) {
      // Keep the transform of a constant image; a pose fixed in the world would add the left
      // image's correction to it.
      if (constant_[i * images + k] != 0) continue;
      const Transform T = poses_[i * images + k] * left.inverse();
      keyframe.T_camera_left[k] = {normalised(T.R), T.t};
    }
  }
  for (std::size_t i = 0; i < points_.size(); ++i) map.points()[owner_[i]].p_world = points_[i];
  outcome.dropped = drop_outliers(map);
  return outcome;
}

}  // namespace vergence::odometry
