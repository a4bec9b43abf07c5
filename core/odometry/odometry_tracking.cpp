#include "core/odometry/odometry.hpp"

#include <algorithm>
#include <bit>
#include <limits>

#include "core/math/robust.hpp"
#include "core/odometry/detail/frame_steps.hpp"

/// Tracking: the pose of a frame from the map's points.
namespace vergence::odometry {

namespace {

/// True if the pose of the sample is accurate enough to follow all points from it. The scale can
/// exceed the limit only if the left camera alone was preferred, whose pose is fitted to all of its
/// points; MLESAC's inliers are within three sigmas.
bool sample_agrees(const PoseFit& fit, double share) noexcept {
  return fit.inliers >= kMinAgreeing && fit.inliers > share * fit.given &&
         fit.scale < kOutlierSigmas;
}

}  // namespace

PoseFit Odometry::fit(const Transform& start, bool sample) noexcept {
  if (link_ == Link::unlinked) return poses_.fit_unlinked(map_, start, sample, rig_.T_camera_left);
  PoseFit all = poses_.fit_linked(map_, start, sample);
  if (!all.found || all.confirmed_stereo() || all.stereo_found == 0) return all;
  return poses_.prefer_left(map_, start, all);
}

PoseFit Odometry::track(const Transform& predicted, std::uint8_t structured,
                        FrameOutcome* out) noexcept {
  PoseFit fit;
  if (structured == 0) return fit;
  StageClock clock(out);
  // Try the prediction, then the prediction with a larger range, then the last pose rotated by the
  // image's shift since then. If an attempt improves the pose, the next one starts from it.
  PoseFit best;
  bool better = false, as_predicted = false;
  for (const int attempt : {0, 1, 2}) {
    const int coarsest = attempt == 0 ? 2 : 3;
    Transform start = better ? best.T_left_world : predicted;
    if (attempt == 2 && !better)
      start = Transform{front_end_.turn_since_kept(), Vec3::Zero()} * motion_.T_left_world();
    // A quarter of the points is enough for MLESAC and takes a third of the time. After a failed
    // attempt half of the points are taken, because few are found from a wrong prediction.
    front_end_.follow_sample(map_, start, options_.features / (attempt == 0 ? 4 : 2), coarsest);
    clock.mark(Stage::track);
    fit = this->fit(start, true);
    clock.mark(Stage::pose);
    // Attempts take samples of different sizes.
    better = sample_agrees(fit, kChanceShare) &&
             fit.inliers * std::max(best.given, 1) > best.inliers * fit.given;
    if (better) best = fit;
    as_predicted = attempt == 0 && sample_agrees(fit, kRigidShare);
    if (sample_agrees(fit, kRigidShare)) break;
  }
  fit = best;
  // Share of the points in view that must be found, because facades look alike. Directly after a
  // posed frame none is required: the right place is then in view and has more matches than a
  // similar one.
  double share = frames_lost_ > 0 || out->gap_s > 0 ? kMajority : 0;
  std::bitset<kMaxPoints> revived;
  if (!sample_agrees(fit, kChanceShare)) {
    fit = relocalise(out, &revived);
    if (!fit.found) return fit;
    share = std::max(share, kMinSeenAgain);
  }
  if (link_ == Link::unlinked) recover_cameras(fit);
  const auto follow_all = [&](const Transform& start) noexcept {
    front_end_.follow_all(map_, start);
    clock.mark(Stage::track);
    PoseFit all = this->fit(start, false);
    if (!all.found || all.inliers < kRigidShare * all.given) all = this->fit(start, true);
    clock.mark(Stage::pose);
    return all;
  };
  Transform start = fit.T_left_world;
  fit = follow_all(start);
  // A pose that was not predicted may be rough: the finest level then finds few points, some of
  // them at wrong places. Continue from the better pose while more points are found; each round
  // reduces the error like a step of a reweighted fit.
  for (int round = 0; !as_predicted && fit.found && round < kReweightings; ++round) {
    const PoseFit before = fit;
    fit = follow_all(before.T_left_world);
    if (fit.found && fit.given > before.given) {
      start = before.T_left_world;
      continue;
    }
    if (!fit.found || fit.given < before.given) fit = follow_all(start);
    break;
  }
  if (share > 0 && fit.inliers < share * points_in_view(fit.T_left_world, revived))
    fit.found = false;
  // If they stayed active, they would count as missing in the next attempt.
  for (std::size_t i = 0; !fit.found && i < map_.points().size(); ++i)
    if (revived[i]) map_.points()[i].stage = PointStage::dormant;
  return fit;
}

void Odometry::recover_cameras(const PoseFit& fit) noexcept {
  for (int k = 1; k < rig_.cameras; ++k) {
    if (has_camera(fit.cameras, k) || front_end_.relocalise(map_, k) < kCameraAlone) continue;
    Transform& T_camera_left = rig_.T_camera_left[static_cast<std::size_t>(k)];
    Transform T_camera_world;
    if (!poses_.fit_camera(map_, k, T_camera_left * fit.T_left_world, &T_camera_world)) continue;
    T_camera_left = T_camera_world * fit.T_left_world.inverse();
  }
}

bool Odometry::in_view(int k, const Vec3& p_camera) const noexcept {
  Vec2 pixel;
  const Camera& camera = front_end_.lens(k).raw();
  return camera.project(p_camera, &pixel, nullptr) == ProjectStatus::ok &&
         camera.inside(pixel, kImageMargin) && !front_end_.hides(k, pixel);
}

int Odometry::points_in_view(const Transform& T_left_world,
                             const std::bitset<kMaxPoints>& revived) const noexcept {
  int n = 0;
  for (std::size_t i = 0; i < map_.points().size(); ++i) {
    const MapPoint& p = map_.points()[i];
    if (p.stage == PointStage::active && !revived[i] && in_view(0, T_left_world * p.p_world)) ++n;
  }
  return n;
}

PoseFit Odometry::relocalise(FrameOutcome* out, std::bitset<kMaxPoints>* revived) noexcept {
  StageClock clock(out);
  for (MapPoint& p : map_.points()) p.now.cameras = 0;
  const int candidates = front_end_.relocalise(map_, 0);
  clock.mark(Stage::match);
  PoseFit fit;
  if (candidates < kMinAgreeing) return fit;
  fit = this->fit(motion_.T_left_world(), true);
  clock.mark(Stage::pose);
  fit.found = sample_agrees(fit, kChanceShare);
  if (!fit.found) return fit;
  out->relocalised = true;
  // Points that are not found are dropped as usual.
  for (std::size_t i = 0; i < map_.points().size(); ++i) {
    MapPoint& p = map_.points()[i];
    if (p.stage != PointStage::dormant) continue;
    p.stage = PointStage::active;
    p.missed = 0;
    revived->set(i);
  }
  return fit;
}

void Odometry::count_across(const PoseFit& fit) noexcept {
  int expected = 0, seen = 0;
  for (MapPoint& p : map_.points()) {
    if (!p.constrains_poses() || !p.now.by(0)) continue;
    const bool now = std::popcount(p.now.cameras) > 1;
    bool visible = now;
    for (int k = 1; k < rig_.cameras && !visible; ++k)
      visible = in_view(
          k, rig_.T_camera_left[static_cast<std::size_t>(k)] * (fit.T_left_world * p.p_world));
    expected += p.across && visible ? 1 : 0;
    seen += p.across && now ? 1 : 0;
    p.across = p.across || now;
  }
  stereo_fails_ = link_ == Link::linked && seen < kMinSeenAgain * expected;
}

void Odometry::settle_points(const PoseFit& fit) noexcept {
  for (MapPoint& p : map_.points()) p.in_images = p.now.cameras;
  for (std::size_t i = 0; i < map_.points().size(); ++i)
    if (map_.points()[i].constrains_poses()) map_.points()[i].now.cameras &= poses_.agrees()[i];
  count_across(fit);
  int tried = 0, kept = 0;
  for (MapPoint& p : map_.points()) {
    if (!p.followed()) continue;
    if (p.stage == PointStage::candidate) {
      ++tried;
      for (int k = 0; k < rig_.cameras; ++k) {
        if (!p.now.by(k)) continue;
        const auto c = static_cast<std::size_t>(k);
        Vec2 pixel;
        const bool seen = front_end_.lens(k).ideal().project(
                              rig_.T_camera_left[c] * (fit.T_left_world * p.p_world), &pixel,
                              nullptr) == ProjectStatus::ok;
        const double limit = kChi2OfPixel * p.now.sigma[c] * p.now.sigma[c];
        if (!seen || (pixel - p.now.pixel[c].cast<double>()).squaredNorm() > 4.0 * limit)
          p.now.drop(k);
      }
      kept += p.now.cameras != 0 ? 1 : 0;
      if (trial_) {
        p.stage = PointStage::free;
        continue;
      }
    }
    if (p.now.cameras != 0) {
      p.missed = 0;
      if (p.found < std::numeric_limits<std::uint16_t>::max()) ++p.found;
      if (p.stage == PointStage::candidate && p.found >= kMinFound) p.stage = PointStage::active;
      continue;
    }
    ++p.missed;
    if (p.stage == PointStage::candidate)
      p.stage = PointStage::free;
    else if (p.missed > kMissesAllowed)
      p.stage = PointStage::dormant;
  }
  const bool few_fit = fit.inliers < kRigidShare * fit.given, few_kept = kept < kMajority * tried;
  const bool others = (few_fit || few_kept) && poses_.others_move(map_, fit.T_left_world);
  others_move_ = few_fit && others;
  new_points_.add(tried, others ? kept : tried);
  frames_untried_ = tried > 0 ? 0 : frames_untried_ + 1;
  trial_ = false;
}

}  // namespace vergence::odometry
