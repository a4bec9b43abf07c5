#include "core/odometry/odometry.hpp"

#include <algorithm>
#include <utility>

#include "core/features/epipolar_search.hpp"
#include "core/math/robust.hpp"
#include "core/odometry/detail/frame_steps.hpp"

/// Maps: initialisation, change of calibration, loss.
namespace vergence::odometry {

namespace {

// Maximum sigma of the direction of t for a start, in rad.
constexpr double kWorstDirection = 0.1;

}  // namespace

bool Odometry::initialise_rig(FrameOutcome* out) noexcept {
  StageClock clock(out);
  const std::span<const FreeMatch> matches = front_end_.match_free(1);
  const auto n = static_cast<int>(matches.size());
  const StereoEstimate e = initialiser_.estimate(matches, rig_);
  clock.mark(Stage::match);
  out->reason = n < options_.min_inliers ? Reason::needs_texture : Reason::uncalibrated;
  if (!e.found || e.inliers < options_.min_inliers || e.inliers < kRigidShare * n) return false;
  // If all points are far away, the direction of t is not determined and depths would be arbitrary.
  if (!(e.direction_sigma < kWorstDirection)) {
    out->reason = Reason::needs_near_structure;
    return false;
  }
  rig_.T_camera_left[1] = e.T_right_left;
  return true;
}

bool Odometry::start_map(const Transform& T_left_world, Stamp stamp, FrameOutcome* out) noexcept {
  StageClock clock(out);
  front_end_.detect_new(nullptr);
  StereoCount stereo = front_end_.match_new();
  // If half of the corners are matched and near, swapped cameras cannot match more by chance.
  const bool asked = stereo.near < kMajority * stereo.corners;
  const bool swapped = asked && front_end_.swapped();
  if (asked) stereo = front_end_.match_new();
  clock.mark(Stage::match);
  if (stereo.corners < options_.min_inliers)
    out->reason = Reason::few_features;
  else if (swapped)
    out->reason = Reason::cameras_swapped;
  else if (!stereo.evidence.fits() || stereo.matched < options_.min_inliers)
    out->reason = Reason::no_stereo_matches;
  else if (stereo.near < kMinAgreeing)
    out->reason = Reason::weak_geometry;
  else {
    map_.clear();
    front_end_.add_points(T_left_world, PointStage::active, &map_);
    new_points_.reset();
    gaps_.clear_rebuild();
    keyframe_points_ = map_.observe(map_.make_keyframe({T_left_world, rig_.T_camera_left, stamp}));
    out->posed = true;
    out->keyframe = true;
    out->reason = Reason::none;
    out->status = PoseStatus::ok;
    out->inliers = stereo.matched;
    out->stereo_inliers = stereo.matched;
    return true;
  }
  return false;
}

void Odometry::begin_map(const RigFrame& frame, const ImageCheck& images,
                         const Transform& predicted, double dt, FrameOutcome* out) noexcept {
  // Without points to follow, this frame starts a map at the predicted end of the last one.
  const Reason of_images = weakness(images, rig_.cameras);
  const bool unknown = link_ == Link::unlinked && !rig_known_;
  bool started = unknown && resume(predicted, frame.stamp, out);
  const bool initialise = unknown && !started;
  if (!started)
    started = (!initialise || initialise_rig(out)) && start_map(predicted, frame.stamp, out);
  if (!started && link_ == Link::linked && out->reason == Reason::no_stereo_matches)
    started = resume(predicted, frame.stamp, out);
  if (!started) {
    if (of_images != Reason::none) out->reason = of_images;
    return;
  }
  if (link_ == Link::unlinked) {
    out->initialised = initialise;
    // Additional cameras see the map that the first two have built.
    PoseFit of_two;
    of_two.T_left_world = predicted;
    of_two.cameras = 0b11;
    if (initialise && rig_.cameras > 2) recover_cameras(of_two);
    rig_known_ = true;
    out->status = PoseStatus::degraded;
    out->reason = Reason::uncalibrated;
  }
  // The other cameras have started the map.
  if (of_images != Reason::none) {
    out->status = PoseStatus::degraded;
    out->reason = of_images;
  }
  if (motion_.any()) {
    out->restarted = true;
    out->gap_s = dt;
    out->expect(dt, predicted * motion_.T_left_world().inverse());
  }
  out->T_left_world = predicted;
  motion_.assume(predicted, frame.stamp);
  frames_lost_ = 0;
}

void Odometry::reset_extrinsics() noexcept {
  rig_known_ = false;
  for (Transform& T : rig_.T_camera_left) T = {};
}

void Odometry::adopt(const RigCalibration& rig) noexcept {
  link_ = Link::linked;
  rig_ = rig;
  rig_known_ = true;
  front_end_.rebuild_lenses();
  front_end_.set_band(options_.band_px);
  window_.adopt_rig();
}

void Odometry::rebuild(FrameOutcome* out) noexcept {
  if (next_rig_ && out->relink_due) {
    const RigCalibration next = *std::exchange(next_rig_, std::nullopt);
    out->relinked = true;
    if (!reexpress_map(next, out)) {
      out->status = PoseStatus::degraded;
      out->reason = Reason::no_stereo_matches;
    }
  } else if (gaps_.rebuild_due() && out->map_rebuild_due) {
    FrameOutcome built;
    built.stage_ms = out->stage_ms;
    out->map_rebuilt = start_map(motion_.T_left_world(), motion_.stamp(), &built);
    out->keyframe = out->keyframe || out->map_rebuilt;
    out->stage_ms = built.stage_ms;
    // The old map continues if a new one cannot be built.
    gaps_.clear_rebuild();
  }
}

bool Odometry::reexpress_map(const RigCalibration& rig, FrameOutcome* out) noexcept {
  const RigCalibration before = rig_;
  const std::array<UndistortedCamera, kMaxCameras> old_lenses = front_end_.lenses();
  const bool was_linked = link_ == Link::linked;
  if (was_linked) last_rig_ = before;
  const auto held =
      std::count_if(map_.points().begin(), map_.points().end(),
                    [](const MapPoint& p) { return p.constrains_poses() && p.now.cameras != 0; });
  adopt(rig);

  // Converts a direction in the old model of camera k to a raw pixel, and to an ideal pixel of the
  // new model.
  const auto seen_again = [&](int k, const Vec3& direction, Vec2* raw, Vec2* ideal) noexcept {
    double unused = 0;
    return old_lenses[static_cast<std::size_t>(k)].raw().project(direction, raw, nullptr) ==
               ProjectStatus::ok &&
           front_end_.lens(k).undistort(*raw, ideal, &unused);
  };
  const auto reexpress = [&](PointObservation* o) noexcept {
    for (int k = 0; k < rig_.cameras; ++k) {
      if (!o->by(k)) continue;
      const auto c = static_cast<std::size_t>(k);
      Vec3 ray;
      Vec2 raw, ideal;
      if (old_lenses[c].ideal().unproject(o->pixel[c].cast<double>(), &ray) &&
          seen_again(k, ray, &raw, &ideal))
        o->pixel[c] = ideal.cast<float>();
      else
        o->drop(k);
    }
  };
  // Triangulates with the new rig the pixels at which the old rig saw X (in the left camera's
  // frame).
  const auto triangulate = [&](const Vec3& X, const Transform& T_right_left_before,
                               Vec3* again) noexcept {
    const Vec3 X_right = T_right_left_before * X;
    Vec2 raw, left, right;
    features::EpipolarCurve curve{&front_end_.lens(1).ideal(), rig_.T_camera_left[1], {}};
    double rho = 1 / X.z(), unused = 0;
    if (!(X.z() > 0) || !(X_right.z() > 0) || !seen_again(0, X, &raw, &left) ||
        !seen_again(1, X_right, &raw, &right) ||
        !front_end_.lens(0).ideal().unproject(left, &curve.ray) ||
        features::fit_inverse_depth(curve, right, &rho, &unused) < 0)
      return false;
    *again = curve.ray / std::max(rho, 1 / (kFarBaselines * rig_.baseline));
    return true;
  };
  // Returns the newest keyframe that saw the point in `left`; if none did, the one where it was
  // created.
  const auto where = [&](const MapPoint& p, Transform* T_left_world,
                         Transform* T_right_left) noexcept {
    *T_left_world = p.T_origin_world;
    *T_right_left = before.T_camera_left[1];
    for (const std::uint8_t slot : map_.order()) {
      if (!p.seen[slot].by(0)) continue;
      *T_left_world = map_.keyframe(slot).T_left_world;
      if (!was_linked) *T_right_left = map_.keyframe(slot).T_camera_left[1];
    }
  };

  // Depths change mainly by one factor; scale the distances between keyframes by it as well.
  std::array<double, kMaxPoints> factors;
  std::size_t n = 0;
  Transform T_left_world, T_right_left;
  for (const MapPoint& p : map_.points()) {
    if (!p.constrains_poses()) continue;
    where(p, &T_left_world, &T_right_left);
    const Vec3 X = T_left_world * p.p_world;
    Vec3 again;
    if (rig_.intrinsics[0].fx * before.baseline > kNearDisparity * X.z() &&
        triangulate(X, T_right_left, &again))
      factors[n++] = again.z() / X.z();
  }
  const double factor = n > 0 ? median(std::span(factors).first(n)) : 1;
  const Vec3 here = motion_.T_left_world().centre();
  for (MapPoint& p : map_.points()) {
    if (p.stage == PointStage::free) continue;
    where(p, &T_left_world, &T_right_left);
    Vec3 X = T_left_world * p.p_world;
    if (!triangulate(X, T_right_left, &X)) X *= factor;
    p.p_world = scaled_about(T_left_world, here, factor).inverse() * X;
    Vec2 raw, ideal;
    // The patch was cut from pixels, so the new model determines its ray.
    if (!seen_again(0, p.ray, &raw, &ideal) ||
        !front_end_.lens(0).ray_jacobian(raw, &p.ray, &p.d_ray_d_pixel))
      p.stage = PointStage::free;
    p.T_origin_world = scaled_about(p.T_origin_world, here, factor);
    reexpress(&p.now);
    for (const std::uint8_t slot : map_.order()) reexpress(&p.seen[slot]);
  }
  for (const std::uint8_t slot : map_.order()) {
    Keyframe& keyframe = map_.keyframe(slot);
    keyframe.T_left_world = scaled_about(keyframe.T_left_world, here, factor);
    keyframe.T_camera_left = rig_.T_camera_left;
  }
  motion_.scale(factor);

  const EpipolarEvidence evidence = front_end_.weigh_points(map_);
  // Add the newest frame as a keyframe, so that the points are also adjusted to its observations.
  const std::size_t newest_slot =
      map_.make_keyframe({motion_.T_left_world(), rig_.T_camera_left, motion_.stamp()});
  (void)map_.observe(newest_slot);
  if (window_.adjust(map_, true).usable) rig_.T_camera_left = window_.T_camera_left();
  const PoseFit newest = poses_.fit_linked(map_, map_.keyframe(newest_slot).T_left_world, false);
  out->points_kept =
      held == 0 ? 1
                : std::min(1.0, static_cast<double>(newest.inliers) / static_cast<double>(held));
  if (newest.found) map_.move_world(newest.T_left_world.inverse() * motion_.T_left_world());
  if (!evidence.fits()) return false;
  // Unlinked cameras have followed fewer points than linked ones can.
  (void)new_points(0, out);
  keyframe_points_ = map_.observe(newest_slot);
  out->keyframe = true;
  return true;
}

bool Odometry::resume(const Transform& T_left_world, Stamp stamp, FrameOutcome* out) noexcept {
  if (!last_rig_) return false;
  const bool was_linked = link_ == Link::linked;
  const RigCalibration now = rig_;
  adopt(*last_rig_);
  FrameOutcome resumed = *out;
  if (start_map(T_left_world, stamp, &resumed)) {
    *out = resumed;
    out->relinked = out->resumed = true;
    out->points_kept = 1;
    last_rig_.reset();
    return true;
  }
  if (was_linked) {
    adopt(now);
  } else {
    unlink();
    reset_extrinsics();
  }
  return false;
}

}  // namespace vergence::odometry
