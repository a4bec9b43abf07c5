#include "core/odometry/odometry.hpp"

#include <algorithm>

#include "core/odometry/detail/frame_steps.hpp"

/// How scenes begin and end.
namespace vergence::odometry {

using detail::kNearEnough;
using detail::kRigidShare;
using detail::StageClock;
using detail::weakness;

namespace {

constexpr int kRestartedFrames = 10;  // frames marked after the scene was rebuilt
constexpr double kCertainShare =
    0.6;  // near matches of the corners above which nobody asks whether the cameras are exchanged
constexpr double kStartShare =
    0.4;  // of the corners that must match: chance across a wrong rig gives a tenth to a quarter
constexpr int kStartMatches = 30;  // points across to start from

constexpr double kWorstDirection = 0.1;  // rad, of t, to start from
constexpr double kWorstRotation = 0.01;  // rad

}  // namespace

bool Odometry::initialise_rig(FrameOutcome* out) noexcept {
  StageClock clock(out);
  const std::span<const FreeMatch> matches = front_end_.match_free(1);
  const std::size_t n = matches.size();
  const StereoEstimate e = initialiser_.estimate(matches, rig_);
  clock.mark(Stage::match);
  out->reason =
      n < static_cast<std::size_t>(kStartMatches) ? Reason::needs_texture : Reason::uncalibrated;
  if (e.status != StereoMlesacStatus::ok || e.inliers < kStartMatches ||
      e.inliers < kRigidShare * static_cast<double>(n))
    return false;
  // A direction of t that the scene does not hold (all of it far away) is no start: depth would be
  // arbitrary.
  if (!(e.direction_sigma < kWorstDirection) || !(e.rotation_sigma < kWorstRotation)) {
    out->reason = Reason::needs_near_structure;
    return false;
  }
  rig_.T_camera_left[1] = e.T_right_left;
  return true;
}

bool Odometry::start_scene(const Transform& T_left_world, Stamp stamp, FrameOutcome* out) noexcept {
  StageClock clock(out);
  map_.clear();
  const StereoCount stereo = front_end_.add_points(map_, T_left_world, PointStage::active);
  clock.mark(Stage::match);
  if (stereo.corners < kStartMatches)
    out->reason = Reason::few_features;
  else if (stereo.near < kCertainShare * stereo.corners &&
           front_end_.count_exchanged() > std::max(stereo.near, kNearEnough - 1))
    out->reason = Reason::cameras_swapped;
  else if (stereo.matched < kStartMatches || stereo.matched < kStartShare * stereo.corners)
    out->reason = Reason::no_stereo_matches;
  else if (stereo.near < kNearEnough)  // the rig fits, and nothing seen holds the scale
    out->reason = Reason::weak_geometry;
  else {
    stereo_fails_ = false;
    moving_.forget_points();
    gaps_.forget();
    const std::size_t slot = map_.make_keyframe(T_left_world, stamp);
    map_.keyframe(slot).T_camera_left = rig_.T_camera_left;
    keyframe_points_ = 0;
    for (MapPoint& p : map_.points()) {
      if (!p.followed()) continue;
      p.seen[slot] = p.now;
      ++keyframe_points_;
    }
    out->posed = true;
    out->keyframe = true;
    out->reason = Reason::none;
    out->status = PoseStatus::ok;
    out->inliers = stereo.matched;
    out->stereo_inliers = stereo.matched;
    return true;
  }
  map_.clear();
  return false;
}

void Odometry::begin_scene(const RigFrame& frame, const ImageCheck& images,
                           const Transform& predicted, double dt, FrameOutcome* out) noexcept {
  // Nothing to follow: this frame begins a scene, where the last one is thought to have ended.
  const Reason of_images = weakness(images, rig_.cameras);
  const bool initialise = link_ == Link::unlinked && !rig_known_;
  bool started = !initialise || initialise_rig(out);
  if (started && !start_scene(predicted, frame.stamp, out)) started = false;
  if (!started) {
    if (of_images != Reason::none) out->reason = of_images;
    return;
  }
  if (link_ == Link::unlinked) {
    out->initialised = initialise;
    // Further cameras see the scene that the first two have made.
    PoseFit of_two;
    of_two.T_left_world = predicted;
    of_two.cameras = 0b11;
    if (initialise && rig_.cameras > 2) recover_cameras(of_two);
    rig_known_ = true;
    out->status = PoseStatus::degraded;
    out->reason = Reason::uncalibrated;
  }
  if (of_images != Reason::none) {  // begun by the other cameras
    out->status = PoseStatus::degraded;
    out->reason = of_images;
  }
  if (motion_.any()) {
    out->restarted = true;
    out->gap_s = dt;
    out->expect(dt, predicted * motion_.T_left_world().inverse());
    restart_cooldown_ = kRestartedFrames;
    out->status = PoseStatus::degraded;
    out->reason = Reason::scene_restarted;
  }
  out->T_left_world = predicted;
  motion_.update(predicted, frame.stamp);
  frames_lost_ = 0;
}

void Odometry::lose_scene() noexcept {
  map_.clear();
  if (link_ == Link::unlinked) reset_extrinsics();
}

void Odometry::reset_extrinsics() noexcept {
  rig_known_ = false;
  for (Transform& T : rig_.T_camera_left) T = {};
}

void Odometry::take_up_link() noexcept {
  link_ = Link::linked;
  rig_ = next_rig_->rig;
  next_rig_.reset();
  rig_known_ = true;
  front_end_.rebuild_lenses();
  front_end_.set_band(options_.band_px);
  window_.take_up_rig();
}

void Odometry::rebuild(FrameOutcome* out) noexcept {
  if (next_rig_ && out->relink_due) {  // the scene was made with another rig
    take_up_link();
    out->relinked = true;
    renew_scene(out);
  } else if (gaps_.renewal_due() && out->renewal_due) {
    out->renewed = true;
    renew_scene(out);
  }
}

void Odometry::renew_scene(FrameOutcome* out) noexcept {
  FrameOutcome built;
  if (start_scene(motion_.T_left_world(), motion_.stamp(), &built)) {
    out->keyframe = true;
  } else {
    out->status = PoseStatus::degraded;
    out->reason = built.reason;
  }
  for (std::size_t i = 0; i < out->stage_ms.size(); ++i) out->stage_ms[i] += built.stage_ms[i];
}

}  // namespace vergence::odometry
