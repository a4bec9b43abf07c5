#include "core/odometry/odometry.hpp"

#include <algorithm>
#include <bit>
#include <chrono>

namespace vergence::odometry {
namespace {

constexpr int kSample =
    100;  // points followed from far away: enough for MLESAC, a third of the work
constexpr int kSampleInliers = 12;         // of the sample, below which the prediction was wrong
constexpr double kSampleShare = 0.3;       // and of those found, which must agree
constexpr double kLeastSampleShare = 0.2;  // where no start does better: a calibration that does
                                           // not fit leaves a quarter of the far points
constexpr double kSampleResidual =
    3.0;  // px: worse than that is no agreement, however many take part in it
constexpr int kRelocaliseInliers = 15;    // that agree on one pose: by chance of rough matches 8 do
constexpr double kRecognisedShare = 0.5;  // of the points in view that must be found again where
                                          // the way to a place was not followed
constexpr std::uint8_t kMissesAllowed = 2;  // frames a point may be hidden
constexpr std::uint16_t kFoundEnough =
    2;                             // rig frames, so four images, before a point holds a pose
constexpr double kOutlier = 9.21;  // squared sigmas, two coordinates at 99 %
constexpr int kNearEnough = 10;    // near points that keep the scale
constexpr int kCameraHolds = 8;    // inliers for a camera to count as one that supports the pose
constexpr double kRigidShare =
    0.4;  // of the points found that must agree: below it something else moves
constexpr int kNewPoints = 30;  // tried in a frame, to judge from
constexpr double kNewPointsKept =
    0.3;  // of the points just made that fit the motion a frame later: half to nine in ten where
          // the scene stands, a twentieth where the pose follows what moves in front of it
constexpr int kFramesUntilTrial =
    3;  // without new points, before some are made to be tried alone: no keyframe is made while
        // the rig stands, and it stands for whoever follows a truck alongside
constexpr double kStereoShare =
    0.5;  // of the points found in two cameras, in which both must agree with the pose
constexpr double kConfirmedShare = 0.3;  // of points and new corners together: 0.44 to 0.65 on a
                                         // rig that fits, 0.12 to 0.2 a frame out of step
constexpr int kRestartedFrames = 10;     // frames marked after the scene was rebuilt
constexpr int kFramesLostBeforeRestart = 3;
constexpr double kLongestExtrapolation = 2.0;  // s: a vehicle's speed says nothing about later
constexpr double kCertainShare =
    0.6;  // near matches of the corners above which nobody asks whether the cameras are exchanged
constexpr double kStartShare =
    0.4;  // of the corners that must match: chance across a wrong rig gives a tenth to a quarter
constexpr int kStartMatches = 30;  // points across to start from

constexpr double kUnlinkedBand =
    4.0;  // px: this frame's transform between the cameras is itself measured
constexpr double kFreeMatchSigma =
    2.0;  // sigmas of a tracked corner: patches are aligned without their shape being known
constexpr double kWorstDirection = 0.1;  // rad, of t, to start from
constexpr double kWorstRotation = 0.01;  // rad

/// A pose of the sample that all points may be followed from.
bool sample_agrees(const PoseFit& fit, double share) noexcept {
  return fit.inliers >= kSampleInliers && fit.inliers > share * fit.given &&
         fit.rms_px < kSampleResidual;
}

class StageClock {
 public:
  explicit StageClock(FrameOutcome* out) noexcept
      : out_(out), last_(std::chrono::steady_clock::now()) {}
  /// What has passed since the last mark belongs to this stage; ms.
  float mark(Stage stage) noexcept {
    const auto now = std::chrono::steady_clock::now();
    const float ms = std::chrono::duration<float, std::milli>(now - last_).count();
    out_->stage_ms[static_cast<std::size_t>(stage)] += ms;
    last_ = now;
    return ms;
  }

 private:
  FrameOutcome* out_;
  std::chrono::steady_clock::time_point last_;
};

}  // namespace

std::size_t Odometry::memory_needed(const OdometryOptions& options, const RigCalibration& rig,
                                    std::span<const ImageView> masks) noexcept {
  const auto n = static_cast<std::size_t>(options.features);
  return FrontEnd::memory_needed(options, rig, masks) + Map::memory_needed() +
         WindowAdjuster::memory_needed(options, rig) + PoseEstimator::memory_needed() +
         StereoMlesac::memory_needed(n) + 5 * (n * sizeof(double) + kCacheLine);
}

Odometry::Odometry(const OdometryOptions& options, const RigCalibration& rig, bool known,
                   Arena& arena, PairRunner& runner, std::span<const ImageView> masks)
    : options_(options),
      rig_(rig),
      link_(known ? Link::linked : Link::unlinked),
      rig_known_(known),
      front_end_(options, rig_, arena, runner, masks),
      map_(static_cast<std::size_t>(options.window_keyframes), arena),
      window_(options, rig_, arena),
      poses_(options, rig_, arena),
      stereo_(static_cast<std::size_t>(options.features), arena),
      random_(options.seed) {
  for (std::span<double>& column : columns_)
    column = arena.make<double>(static_cast<std::size_t>(options.features), "matches across");
  if (known) return;
  unlink();
  reset_extrinsics();
}

void Odometry::link(const RigCalibration& rig) noexcept {
  next_rig_ = rig;
  link_pending_ = true;
}

void Odometry::unlink() noexcept {
  link_ = Link::unlinked;
  link_pending_ = false;
  front_end_.set_band(std::max(options_.band_px, kUnlinkedBand));
}

Transform Odometry::predict(double dt_s) const noexcept {
  return {normalised(exp_so3(turn_per_s_ * dt_s) * T_left_world_.R),
          exp_so3(turn_per_s_ * dt_s) * T_left_world_.t + shift_per_s_ * dt_s};
}

void Odometry::remember(const Transform& T_left_world, Stamp stamp) noexcept {
  const double dt = (stamp - stamp_).to_seconds();
  if (any_pose_ && dt > 0 && dt <= options_.max_gap_s) {
    const Transform step = T_left_world * T_left_world_.inverse();
    turn_per_s_ = log_so3(step.R) / dt;
    shift_per_s_ = step.t / dt;
  }
  T_left_world_ = T_left_world;
  stamp_ = stamp;
  any_pose_ = true;
}

PoseFit Odometry::fit(const Transform& start, bool sample) noexcept {
  if (link_ == Link::unlinked) return poses_.fit_unlinked(map_, start, sample, rig_.T_camera_left);
  PoseFit all = poses_.fit_linked(map_, start, sample);
  if (!all.found || confirmed_stereo(all) || all.stereo_found == 0) return all;
  // The cameras contradict each other. Which is right the images do not say, but the left one is
  // what the pose is of.
  const PoseFit left = poses_.fit_left(map_, start);
  return left.found && left.inliers >= options_.ok_inliers ? left : all;
}

PoseFit Odometry::track(const Transform& predicted, std::uint8_t structured,
                        FrameOutcome* out) noexcept {
  PoseFit fit;
  if (structured == 0) return fit;
  StageClock clock(out);
  // From the prediction; if that was wrong, from further away; if that was, from where the last
  // frame stood.
  struct Attempt {
    const Transform* start;
    int coarsest;
  };
  PoseFit best;
  for (const Attempt& a :
       {Attempt{&predicted, 2}, Attempt{&predicted, 3}, Attempt{&T_left_world_, 3}}) {
    front_end_.follow_sample(map_, *a.start, kSample, a.coarsest);
    clock.mark(Stage::track);
    fit = this->fit(*a.start, true);
    clock.mark(Stage::pose);
    if (sample_agrees(fit, kLeastSampleShare) && fit.inliers > best.inliers) best = fit;
    if (sample_agrees(fit, kSampleShare)) break;
  }
  fit = best;
  bool doubtful = frames_lost_ > 0 || out->gap_s > 0;
  if (!sample_agrees(fit, kLeastSampleShare)) {
    fit = relocalise(out);
    if (!fit.found) return fit;
    doubtful = true;
  }
  const Transform coarse = fit.T_left_world;
  if (link_ == Link::unlinked) recover_cameras(fit);
  front_end_.follow_all(map_, coarse);
  clock.mark(Stage::track);
  fit = this->fit(coarse, false);
  if (!fit.found || fit.inliers < kRigidShare * fit.given) fit = this->fit(coarse, true);
  // One facade looks like the next: a place is believed again only if most of what should be seen
  // from there is.
  if (doubtful && fit.inliers < kRecognisedShare * points_in_view(fit.T_left_world))
    fit.found = false;
  clock.mark(Stage::pose);
  return fit;
}

void Odometry::recover_cameras(const PoseFit& fit) noexcept {
  for (int k = 1; k < rig_.cameras; ++k) {
    if (((fit.cameras >> static_cast<unsigned>(k)) & 1U) != 0 ||
        front_end_.relocalise(map_, k) < kRelocaliseInliers)
      continue;
    Transform& T_camera_left = rig_.T_camera_left[static_cast<std::size_t>(k)];
    Transform T_camera_world;
    if (!poses_.fit_camera(map_, k, T_camera_left * fit.T_left_world, true, &T_camera_world))
      continue;
    T_camera_left = T_camera_world * fit.T_left_world.inverse();
  }
}

int Odometry::points_in_view(const Transform& T_left_world) const noexcept {
  constexpr double kBorder = 12.0;  // px: nearer to the edge a patch does not fit
  int n = 0;
  for (const MapPoint& p : map_.points()) {
    Vec2 pixel;
    const Camera& camera = front_end_.lens(0).raw();
    if (p.stage == PointStage::active &&
        camera.project(T_left_world * p.p_world, &pixel, nullptr) == ProjectStatus::ok &&
        camera.inside(pixel, kBorder) && !front_end_.hides(0, pixel))
      ++n;
  }
  return n;
}

PoseFit Odometry::relocalise(FrameOutcome* out) noexcept {
  StageClock clock(out);
  for (MapPoint& p : map_.points()) p.now.cameras = 0;
  const int candidates = front_end_.relocalise(map_, 0);
  clock.mark(Stage::match);
  PoseFit fit;
  if (candidates < kRelocaliseInliers) return fit;
  fit = this->fit(T_left_world_, true);
  clock.mark(Stage::pose);
  fit.found = fit.inliers >= kRelocaliseInliers;
  if (!fit.found) return fit;
  out->relocalised = true;
  // Points long out of sight are followed again; those that do not show are dropped as any other.
  for (MapPoint& p : map_.points()) {
    if (p.stage != PointStage::dormant) continue;
    p.stage = PointStage::active;
    p.missed = 0;
  }
  return fit;
}

void Odometry::settle_points(const PoseFit& fit) noexcept {
  for (MapPoint& p : map_.points()) p.in_images = p.now.cameras;
  for (std::size_t i = 0; i < map_.points().size(); ++i)
    if (map_.points()[i].holds_poses()) map_.points()[i].now.cameras &= poses_.agrees()[i];
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
        const double limit = kOutlier * p.now.sigma[c] * p.now.sigma[c];
        if (!seen || (pixel - p.now.pixel[c].cast<double>()).squaredNorm() > 4.0 * limit)
          p.now.drop(k);
      }
      kept += p.now.cameras != 0 ? 1 : 0;
      if (on_trial_) {
        p.stage = PointStage::free;
        continue;
      }
    }
    if (p.now.cameras != 0) {
      p.missed = 0;
      ++p.found;
      if (p.stage == PointStage::candidate && p.found >= kFoundEnough) p.stage = PointStage::active;
      continue;
    }
    ++p.missed;
    if (p.stage == PointStage::candidate)
      p.stage = PointStage::free;
    else if (p.missed > kMissesAllowed)
      p.stage = PointStage::dormant;
  }
  if (tried >= kNewPoints) scene_moves_ = kept < kNewPointsKept * tried;
  frames_untried_ = tried > 0 ? 0 : frames_untried_ + 1;
  if (on_trial_) map_.rewind(cursor_before_trial_);
  on_trial_ = false;
}

bool Odometry::wants_keyframe() const noexcept {
  const std::size_t last = map_.order()[map_.order().size() - 1];
  std::array<float, kMaxPoints> turn;
  std::size_t n = 0;
  int active = 0;
  for (const MapPoint& p : map_.points()) {
    if (p.stage != PointStage::active || !p.now.by(0)) continue;
    ++active;
    if (p.seen[last].by(0)) turn[n++] = (p.now.pixel[0] - p.seen[last].pixel[0]).norm();
  }
  if (active < options_.keyframe_tracked * keyframe_points_) return true;
  if (n == 0) return true;
  const auto middle = turn.begin() + static_cast<std::ptrdiff_t>(n / 2);
  std::nth_element(turn.begin(), middle, turn.begin() + static_cast<std::ptrdiff_t>(n));
  return *middle > options_.keyframe_parallax * rig_.intrinsics[0].fx;
}

double Odometry::renew_scale(std::size_t slot) noexcept {
  const double length = map_.keyframe(slot).T_camera_left[1].t.norm();
  if (!(length > 0.1 * rig_.baseline && length < 10.0 * rig_.baseline)) return 1.0;
  const double factor = rig_.baseline / length;
  const Vec3 here = map_.keyframe(slot).T_left_world.centre();
  map_.scale_about(here, factor);
  shift_per_s_ *= factor;
  return factor;
}

void Odometry::make_keyframe(const PoseFit& fit, Stamp stamp, FrameOutcome* out) noexcept {
  StageClock clock(out);
  const std::size_t slot = map_.make_keyframe(T_left_world_, stamp);
  map_.keyframe(slot).T_camera_left = rig_.T_camera_left;
  for (MapPoint& p : map_.points())
    if (p.followed()) p.seen[slot] = p.now;
  WindowOutcome window;
  if (link_ == Link::linked) {
    window = window_.adjust(map_, out->effort);
    if (window.usable)
      std::copy_n(window_.T_camera_left().begin(), rig_.cameras, rig_.T_camera_left.begin());
  } else {
    window = window_.adjust_unlinked(map_, out->effort);
    out->scale = renew_scale(slot);
    rig_.T_camera_left = map_.keyframe(slot).T_camera_left;
  }
  T_left_world_ = map_.keyframe(slot).T_left_world;
  const auto keyframes = std::min<std::size_t>(map_.order().size(), out->effort.window_keyframes);
  budget_.window_took(static_cast<double>(clock.mark(Stage::window)), static_cast<int>(keyframes),
                      window.steps);
  const StereoCount stereo =
      front_end_.add_points(map_, T_left_world_, PointStage::candidate, out->effort);
  // Of all that the left image offers, how much the other cameras confirm.
  stereo_fails_ = stereo.matched + fit.stereo < kConfirmedShare * (stereo.corners + fit.inliers);
  keyframe_points_ = 0;
  for (MapPoint& p : map_.points()) {
    if (!p.followed()) continue;
    p.seen[slot] = p.now;
    if (p.now.by(0)) ++keyframe_points_;
  }
  budget_.points_took(static_cast<double>(clock.mark(Stage::match)), out->effort);
  out->stage_ms[static_cast<std::size_t>(Stage::match)] -= front_end_.detect_ms();
  out->stage_ms[static_cast<std::size_t>(Stage::detect)] += front_end_.detect_ms();
  out->keyframe = true;
}

bool Odometry::initialise_rig(FrameOutcome* out) noexcept {
  StageClock clock(out);
  const std::span<const FreeMatch> matches = front_end_.match_free(1);
  const Pinhole left{rig_.intrinsics[0].fx, rig_.intrinsics[0].fy, rig_.intrinsics[0].cx,
                     rig_.intrinsics[0].cy};
  const Pinhole right{rig_.intrinsics[1].fx, rig_.intrinsics[1].fy, rig_.intrinsics[1].cx,
                      rig_.intrinsics[1].cy};
  const std::size_t n = matches.size();
  for (std::size_t i = 0; i < n; ++i) {
    columns_[0][i] = (matches[i].left.x() - left.cx) / left.fx;
    columns_[1][i] = (matches[i].left.y() - left.cy) / left.fy;
    columns_[2][i] = (matches[i].other.x() - right.cx) / right.fx;
    columns_[3][i] = (matches[i].other.y() - right.cy) / right.fy;
    columns_[4][i] = kFreeMatchSigma * matches[i].sigma / left.fx;
  }
  const StereoMatches rays{columns_[0].first(n), columns_[1].first(n), columns_[2].first(n),
                           columns_[3].first(n), columns_[4].first(n)};
  const StereoEstimate e =
      stereo_.estimate_stereo_transform(rays, rig_.baseline, StereoMlesacOptions{}, random_);
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
           front_end_.count_exchanged() > stereo.near)
    out->reason = Reason::cameras_swapped;
  else if (stereo.matched < kStartMatches || stereo.matched < kStartShare * stereo.corners ||
           stereo.near < kNearEnough)
    out->reason = Reason::no_stereo_matches;
  else {
    stereo_fails_ = scene_moves_ = false;
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

bool Odometry::confirmed_stereo(const PoseFit& fit) noexcept {
  return std::popcount(fit.cameras) >= 2 && fit.stereo >= kStereoShare * fit.stereo_found;
}

Reason Odometry::weakness(const ImageCheck& images) const noexcept {
  const auto all = static_cast<std::uint8_t>((1U << static_cast<unsigned>(rig_.cameras)) - 1U);
  if (images.given != all) return Reason::no_image;
  if (images.repeated) return Reason::image_repeated;
  return images.structured != all ? Reason::image_dark : Reason::none;
}

void Odometry::judge(const PoseFit& fit, const ImageCheck& images,
                     FrameOutcome* out) const noexcept {
  out->status = PoseStatus::degraded;
  const Reason of_images = weakness(images);
  if (restart_cooldown_ > 0)
    out->reason = Reason::scene_restarted;
  else if (of_images != Reason::none)
    out->reason = of_images;
  else if (out->gap_s > 0)
    out->reason = Reason::time_gap;
  else if (std::popcount(fit.cameras) < 2)
    out->reason = Reason::one_camera;
  else if (stereo_fails_ || !confirmed_stereo(fit))
    out->reason = Reason::no_stereo_matches;
  else if (fit.inliers < options_.ok_inliers)
    out->reason = Reason::few_inliers;
  else if (fit.inliers < kRigidShare * fit.given || (link_ == Link::linked && scene_moves_))
    out->reason = Reason::moving_scene;
  else if (fit.near < kNearEnough)
    out->reason = Reason::weak_geometry;
  else if (link_ == Link::unlinked)
    out->reason = Reason::uncalibrated;
  else {
    out->reason = Reason::none;
    out->status = PoseStatus::ok;
  }
}

void Odometry::begin_scene(const RigFrame& frame, const ImageCheck& images,
                           const Transform& predicted, double dt, FrameOutcome* out) noexcept {
  // Nothing to follow: this frame begins a scene, where the last one is thought to have ended.
  const bool initialise = link_ == Link::unlinked && !rig_known_;
  bool started = !initialise || initialise_rig(out);
  if (started && !start_scene(predicted, frame.stamp, out)) started = false;
  if (!started) {
    if (weakness(images) != Reason::none) out->reason = weakness(images);
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
  if (any_pose_) {
    out->restarted = true;
    out->gap_s = dt;
    restart_cooldown_ = kRestartedFrames;
    out->status = PoseStatus::degraded;
    out->reason = Reason::scene_restarted;
  }
  out->T_left_world = predicted;
  remember(predicted, frame.stamp);
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
  link_pending_ = false;
  link_ = Link::linked;
  rig_ = next_rig_;
  rig_known_ = true;
  front_end_.rebuild_lenses();
  front_end_.set_band(options_.band_px);
  window_.take_up_rig();
}

void Odometry::rebuild(FrameOutcome* out) noexcept {
  if (!link_pending_ || !out->relink_due) return;
  // The scene was made with another rig: it is rebuilt, where the camera now is.
  take_up_link();
  out->relinked = true;
  FrameOutcome built;
  if (!start_scene(T_left_world_, stamp_, &built)) out->reason = built.reason;
}

void Odometry::try_points() noexcept {
  cursor_before_trial_ = map_.cursor();
  (void)front_end_.add_points(map_, T_left_world_, PointStage::candidate);
  on_trial_ = true;
}

FrameOutcome Odometry::process(const RigFrame& frame, Duration budget) noexcept {
  FrameOutcome out;
  StageClock clock(&out);
  budget_.begin(budget);
  const ImageCheck images = front_end_.begin(frame);
  clock.mark(Stage::pyramid);
  out.images_good = weakness(images) == Reason::none;
  const double dt = any_pose_ ? (frame.stamp - stamp_).to_seconds() : 0.0;
  const Transform predicted =
      any_pose_ ? predict(std::min(dt, kLongestExtrapolation)) : Transform{};

  if (map_.order().empty()) {
    if (link_pending_) {
      take_up_link();
      out.relinked = true;
    }
    begin_scene(frame, images, predicted, dt, &out);
    return out;
  }

  if (dt > options_.max_gap_s && frames_lost_ == 0) out.gap_s = dt;
  const PoseFit fit = track(predicted, images.structured, &out);
  if (!fit.found) {
    out.reason = weakness(images) != Reason::none ? weakness(images)
                 : out.gap_s > 0                  ? Reason::time_gap
                                                  : Reason::no_pose;
    if (images.structured != 0 && ++frames_lost_ >= kFramesLostBeforeRestart) lose_scene();
    return out;
  }
  settle_points(fit);
  frames_lost_ = 0;
  out.posed = true;
  out.inliers = fit.inliers;
  out.stereo_inliers = fit.stereo;
  out.reprojection_px = fit.rms_px;
  // The same image again says nothing about motion: the speed stays what it was.
  if (images.repeated)
    out.T_left_world = T_left_world_;
  else
    remember(fit.T_left_world, frame.stamp);
  out.T_left_world = T_left_world_;
  judge(fit, images, &out);
  const FrameEffort effort =
      frame.effort ? *frame.effort
                   : budget_.plan(static_cast<int>(map_.order().size()) + 1, options_.window_steps);
  if (link_pending_ && weakness(images) == Reason::none) {
    out.relink_due = true;
  } else if (confirmed_stereo(fit) && !images.repeated && wants_keyframe()) {
    out.effort = effort;
    make_keyframe(fit, frame.stamp, &out);
    out.T_left_world = T_left_world_;
  } else if (frames_untried_ >= kFramesUntilTrial && out.images_good && link_ == Link::linked) {
    out.effort.points_percent = effort.points_percent;
    if (effort.points_percent == 100) try_points();
  }
  if (restart_cooldown_ > 0) --restart_cooldown_;
  return out;
}

}  // namespace vergence::odometry
