#include "core/odometry/window.hpp"

#include <algorithm>

#include "core/odometry/lens.hpp"

namespace vergence::odometry {
namespace {

constexpr std::size_t kMaxWindowPoints = 1024;
constexpr std::size_t kSightingsAPoint = 10;  // on average, of all cameras; more are left out of the step
constexpr float kOutlier = 16.F;              // squared whitened residual, 2 degrees of freedom: 3e-4 of Gaussian errors
constexpr double kMinDepthOfPoint = 0.05;     // m in front of every camera that sees it

}  // namespace

BundleCapacities WindowAdjuster::capacities(const OdometryOptions& options, const RigCalibration& rig) noexcept {
  BundleCapacities c;
  c.cameras = static_cast<std::size_t>(rig.cameras);
  c.poses = static_cast<std::size_t>(options.window_keyframes);
  c.points = kMaxWindowPoints;
  c.observations = kMaxWindowPoints * kSightingsAPoint;
  c.shared = false;
  return c;
}

std::size_t WindowAdjuster::memory_needed(const OdometryOptions& options, const RigCalibration& rig) noexcept {
  const BundleCapacities c = capacities(options, rig);
  return BundleAdjuster::memory_needed(c) + c.points * (sizeof(Vec3) + sizeof(std::uint16_t)) +
         c.observations * (sizeof(BundleObservation) + sizeof(float)) + 8 * kCacheLine;
}

WindowAdjuster::WindowAdjuster(const OdometryOptions& options, const RigCalibration& rig, Arena& arena)
    : options_(options), rig_(rig), adjuster_(capacities(options, rig), arena) {
  const BundleCapacities c = capacities(options, rig);
  points_ = BoundedVector<Vec3>(arena.make<Vec3>(c.points, "window points"));
  owner_ = BoundedVector<std::uint16_t>(arena.make<std::uint16_t>(c.points, "window points"));
  observations_ = BoundedVector<BundleObservation>(arena.make<BundleObservation>(c.observations, "window observations"));
  residuals_ = arena.make<float>(c.observations, "window residuals");
  for (int k = 0; k < rig.cameras; ++k) cameras_[static_cast<std::size_t>(k)] = Lens(rig.intrinsics[static_cast<std::size_t>(k)]).ideal();
}

void WindowAdjuster::gather(Map& map) noexcept {
  poses_.clear();
  points_.clear();
  owner_.clear();
  observations_.clear();
  for (const std::uint8_t slot : map.order()) (void)poses_.push(map.keyframe(slot).T_left_world);
  const std::span<MapPoint> all = map.points();
  for (std::size_t i = 0; i < all.size(); ++i) {
    const MapPoint& p = all[i];
    if (!p.holds_poses()) continue;
    const std::size_t first = observations_.size();
    int keyframes = 0;
    bool fits = !points_.full();
    for (std::size_t pose = 0; pose < map.order().size() && fits; ++pose) {
      const Sighting& s = p.seen[map.order()[pose]];
      if (s.cameras == 0) continue;
      ++keyframes;
      for (int k = 0; k < rig_.cameras && fits; ++k) {
        if (!s.by(k)) continue;
        const auto c = static_cast<std::size_t>(k);
        if ((rig_.T_camera_left[c] * (poses_[pose] * p.p_world)).z() < kMinDepthOfPoint) continue;
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
    // Seen from one place only, a point says nothing about poses.
    if (!fits || keyframes < 2 || observations_.size() - first < 2) {
      observations_.truncate(first);
      continue;
    }
    (void)points_.push(p.p_world);
    (void)owner_.push(static_cast<std::uint16_t>(i));
  }
}

int WindowAdjuster::drop_outliers(Map& map) noexcept {
  int dropped = 0;
  for (std::size_t i = 0; i < observations_.size(); ++i) {
    if (!(residuals_[i] > kOutlier)) continue;
    const BundleObservation& o = observations_[i];
    MapPoint& p = map.points()[owner_[o.point]];
    p.seen[map.order()[o.pose]].drop(o.camera);
    ++dropped;
  }
  return dropped;
}

WindowOutcome WindowAdjuster::adjust(Map& map) noexcept {
  WindowOutcome outcome;
  gather(map);
  outcome.points = static_cast<int>(points_.size());
  outcome.observations = static_cast<int>(observations_.size());
  if (poses_.size() < 2 || points_.empty()) return outcome;
  T_camera_left_ = rig_.T_camera_left;

  const auto n = static_cast<std::size_t>(rig_.cameras);
  BundleProblem problem;
  problem.cameras = std::span(cameras_).first(n);
  problem.T_camera_left = std::span(T_camera_left_).first(n);
  problem.T_left_world = poses_.span();
  problem.points = points_.span();
  problem.observations = observations_.span();
  problem.squared_residuals = residuals_.first(observations_.size());
  BundleOptions how;
  how.configuration = BundleConfiguration::stereo_odometry;
  how.loss = BundleLoss::huber;
  how.loss_threshold = options_.huber;
  how.max_steps = options_.window_steps;
  how.cost_tolerance = 1e-4;
  const BundleResult result = adjuster_.solve(problem, how);
  outcome.termination = result.termination;
  outcome.steps = result.steps;
  outcome.rms_px = result.rms_px;
  if (!result.usable()) return outcome;
  for (std::size_t i = 0; i < poses_.size(); ++i) {
    Transform& T = map.keyframe(map.order()[i]).T_left_world;
    T = {normalised(poses_[i].R), poses_[i].t};
  }
  for (std::size_t i = 0; i < points_.size(); ++i) map.points()[owner_[i]].p_world = points_[i];
  outcome.dropped = drop_outliers(map);
  return outcome;
}

}  // namespace vergence::odometry
