#include "core/odometry/odometry.hpp"

#include <algorithm>
#include <bit>
#include <chrono>

namespace vergence::odometry {
namespace {

constexpr int kSample = 100;                // points followed from far away: enough for MLESAC, a third of the work
constexpr int kSampleInliers = 12;          // of the sample, below which the prediction was wrong
constexpr double kSampleShare = 0.3;        // and of those found, which must agree
constexpr int kRelocaliseInliers = 15;      // that agree on one pose: by chance of rough matches 8 do
constexpr double kRecognisedShare = 0.5;    // of the points in view that must be found again where the way to a place was not followed
constexpr std::uint8_t kMissesAllowed = 2;  // frames a point may be hidden
constexpr std::uint16_t kFoundEnough = 2;   // rig frames, so four images, before a point holds a pose
constexpr double kOutlier = 9.21;           // squared sigmas, two coordinates at 99 %
constexpr int kNearEnough = 10;             // near points that keep the scale
constexpr int kCameraHolds = 8;             // inliers for a camera to count as one that supports the pose
constexpr double kRigidShare = 0.4;         // of the points found that must agree: below it something else moves
constexpr double kAcrossShare = 0.5;        // of the points found in two cameras, in which both must agree with the pose
constexpr double kConfirmedShare =
    0.3;  // of points and new corners together: 0.44 to 0.65 on a rig that fits, 0.12 to 0.2 a frame out of step
constexpr int kRestartedFrames = 10;  // frames marked after the scene was built anew
constexpr int kFramesLostBeforeRestart = 3;
constexpr double kLongestExtrapolation = 2.0;  // s: a vehicle's speed says nothing about later
constexpr double kCertainShare = 0.6;          // near matches of the corners above which nobody asks whether the cameras are exchanged
constexpr double kStartShare = 0.4;            // of the corners that must match: chance across a wrong rig gives a tenth to a quarter
constexpr int kStartMatches = 30;              // points across to start from

class StageClock {
 public:
  explicit StageClock(FrameOutcome* out) noexcept : out_(out), last_(std::chrono::steady_clock::now()) {}
  /// What has passed since the last mark belongs to this stage.
  void mark(Stage stage) noexcept {
    const auto now = std::chrono::steady_clock::now();
    out_->stage_ms[static_cast<std::size_t>(stage)] += std::chrono::duration<float, std::milli>(now - last_).count();
    last_ = now;
  }

 private:
  FrameOutcome* out_;
  std::chrono::steady_clock::time_point last_;
};

}  // namespace

std::size_t Odometry::memory_needed(const OdometryOptions& options, const RigCalibration& rig) noexcept {
  return FrontEnd::memory_needed(options, rig) + Map::memory_needed() + WindowAdjuster::memory_needed(options, rig) +
         RigObservationTable::memory_needed(kMaxPoints) + RigMlesac::memory_needed(kMaxPoints) + PoseRefiner::memory_needed(kMaxPoints) +
         kMaxPoints * sizeof(std::uint16_t) + 2 * kCacheLine;
}

Odometry::Odometry(const OdometryOptions& options, const RigCalibration& rig, Arena& arena, PairRunner& runner)
    : options_(options),
      rig_(rig),
      front_end_(options, rig, arena, runner),
      map_(static_cast<std::size_t>(options.window_keyframes), arena),
      window_(options, rig, arena),
      table_(kMaxPoints, arena),
      mlesac_(kMaxPoints, arena),
      refiner_(kMaxPoints, arena),
      owner_(arena.make<std::uint16_t>(kMaxPoints, "pose rows")),
      random_(options.seed) {
  table_.set_rig(rig);
}

Transform Odometry::predict(double dt_s) const noexcept {
  return {normalised(exp_so3(turn_per_s_ * dt_s) * T_left_world_.R), exp_so3(turn_per_s_ * dt_s) * T_left_world_.t + shift_per_s_ * dt_s};
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

void Odometry::collect() noexcept {
  table_.clear();
  owner_.clear();
  const std::span<MapPoint> points = map_.points();
  for (std::size_t i = 0; i < points.size(); ++i) {
    const MapPoint& p = points[i];
    if (!p.holds_poses() || p.now.cameras == 0) continue;
    const auto first = static_cast<std::size_t>(std::countr_zero(p.now.cameras));
    if (!table_.push(p.p_world, p.now.sigma[first])) return;
    for (int k = 0; k < rig_.cameras; ++k)
      if (p.now.by(k)) table_.see(k, p.now.pixel[static_cast<std::size_t>(k)].cast<double>());
    (void)owner_.push(static_cast<std::uint16_t>(i));
  }
}

Odometry::PoseFit Odometry::fit_pose(const Transform& start, bool sample) noexcept {
  PoseFit fit;
  collect();
  fit.given = static_cast<int>(table_.size());
  if (fit.given < 3) return fit;
  Transform T = start;
  if (sample) {
    MlesacOptions how;
    how.max_hypotheses = options_.mlesac_hypotheses;
    const MlesacPose m = mlesac_.solve(table_.view(), how, &start, random_);
    if (m.status != MlesacStatus::ok) return fit;
    T = m.T_left_world;
  }
  PoseRefineOptions refine;
  refine.huber = options_.huber;
  refine.inlier_chi2 = kOutlier;
  const RefinedPose r = refiner_.refine(table_.view(), T, sample ? mlesac_.flags() : std::span<const std::uint8_t>{}, refine);
  if (!r.usable()) return fit;
  fit.T_left_world = r.T_left_world;
  fit.rms_px = r.rms_px;
  std::array<int, kMaxCameras> held{};
  for (std::size_t i = 0; i < owner_.size(); ++i) {
    const std::uint8_t good = refiner_.flags()[i];
    if (std::popcount(map_.points()[owner_[i]].now.cameras) > 1) ++fit.across;
    if (good == 0) continue;
    ++fit.inliers;
    for (int k = 0; k < rig_.cameras; ++k) held[static_cast<std::size_t>(k)] += (good >> k) & 1;
    if ((good & 1U) == 0 || (good & ~1U) == 0) continue;
    ++fit.stereo;
    const MapPoint& p = map_.points()[owner_[i]];
    const double z = (fit.T_left_world * p.p_world).z();
    const auto other = static_cast<std::size_t>(std::countr_zero(static_cast<unsigned>(good & ~1U)));
    if (rig_.intrinsics[0].fx * rig_.T_camera_left[other].t.norm() > kNearDisparity * z) ++fit.near;
  }
  for (int k = 0; k < rig_.cameras; ++k)
    if (held[static_cast<std::size_t>(k)] >= kCameraHolds)
      fit.cameras = static_cast<std::uint8_t>(fit.cameras | (1U << static_cast<unsigned>(k)));
  // One camera alone measures no depth and makes no new points: what is left of the map has to hold the pose well.
  fit.found = fit.inliers >= (std::popcount(fit.cameras) < 2 ? options_.ok_inliers : options_.min_inliers);
  return fit;
}

Odometry::PoseFit Odometry::track(const Transform& predicted, std::uint8_t structured, FrameOutcome* out) noexcept {
  PoseFit fit;
  if (structured == 0) return fit;
  StageClock clock(out);
  // From the prediction; if that was wrong, from further away; if that was, from where the last frame stood.
  struct Attempt {
    const Transform* start;
    int coarsest;
  };
  for (const Attempt& a : {Attempt{&predicted, 2}, Attempt{&predicted, 3}, Attempt{&T_left_world_, 3}}) {
    front_end_.follow_sample(map_, *a.start, kSample, a.coarsest);
    clock.mark(Stage::track);
    fit = fit_pose(*a.start, true);
    clock.mark(Stage::pose);
    if (fit.inliers >= kSampleInliers && fit.inliers > kSampleShare * fit.given) break;
  }
  bool doubtful = frames_lost_ > 0 || out->gap_s > 0;
  if (fit.inliers < kSampleInliers || fit.inliers <= kSampleShare * fit.given) {
    fit = relocalise(out);
    if (!fit.found) return fit;
    doubtful = true;
  }
  const Transform coarse = fit.T_left_world;
  front_end_.follow_all(map_, coarse);
  clock.mark(Stage::track);
  fit = fit_pose(coarse, false);
  if (!fit.found || fit.inliers < kRigidShare * fit.given) fit = fit_pose(coarse, true);
  // One facade looks like the next: a place is believed again only if most of what should be seen from there is.
  if (doubtful && fit.inliers < kRecognisedShare * points_in_view(fit.T_left_world)) fit.found = false;
  clock.mark(Stage::pose);
  return fit;
}

int Odometry::points_in_view(const Transform& T_left_world) const noexcept {
  constexpr double kBorder = 12.0;  // px: nearer to the edge a patch does not fit
  int n = 0;
  for (const MapPoint& p : map_.points()) {
    Vec2 pixel;
    const Camera& camera = front_end_.lens(0).raw();
    if (p.stage == PointStage::active && camera.project(T_left_world * p.p_world, &pixel, nullptr) == ProjectStatus::ok &&
        camera.inside(pixel, kBorder))
      ++n;
  }
  return n;
}

Odometry::PoseFit Odometry::relocalise(FrameOutcome* out) noexcept {
  StageClock clock(out);
  const int candidates = front_end_.find_again(map_);
  clock.mark(Stage::match);
  PoseFit fit;
  if (candidates < kRelocaliseInliers) return fit;
  fit = fit_pose(T_left_world_, true);
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
  for (std::size_t i = 0; i < owner_.size(); ++i) map_.points()[owner_[i]].now.cameras &= refiner_.flags()[i];
  for (MapPoint& p : map_.points()) {
    if (!p.followed()) continue;
    if (p.stage == PointStage::candidate) {
      for (int k = 0; k < rig_.cameras; ++k) {
        if (!p.now.by(k)) continue;
        const auto c = static_cast<std::size_t>(k);
        Vec2 pixel;
        const bool seen = front_end_.lens(k).ideal().project(rig_.T_camera_left[c] * (fit.T_left_world * p.p_world), &pixel, nullptr) ==
                          ProjectStatus::ok;
        const double limit = kOutlier * p.now.sigma[c] * p.now.sigma[c];
        if (!seen || (pixel - p.now.pixel[c].cast<double>()).squaredNorm() > 4.0 * limit) p.now.drop(k);
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

void Odometry::make_keyframe(const PoseFit& fit, Stamp stamp, FrameOutcome* out) noexcept {
  StageClock clock(out);
  const std::size_t slot = map_.make_keyframe(T_left_world_, stamp);
  for (MapPoint& p : map_.points())
    if (p.followed()) p.seen[slot] = p.now;
  (void)window_.adjust(map_);
  T_left_world_ = map_.keyframe(slot).T_left_world;
  clock.mark(Stage::window);
  const AcrossCount across = front_end_.add_points(map_, T_left_world_, PointStage::candidate);
  // Of all that the left image offers, how much the other cameras confirm.
  across_fails_ = across.matched + fit.stereo < kConfirmedShare * (across.corners + fit.inliers);
  keyframe_points_ = 0;
  for (MapPoint& p : map_.points()) {
    if (!p.followed()) continue;
    p.seen[slot] = p.now;
    if (p.now.by(0)) ++keyframe_points_;
  }
  clock.mark(Stage::match);
  out->stage_ms[static_cast<std::size_t>(Stage::match)] -= front_end_.detect_ms();
  out->stage_ms[static_cast<std::size_t>(Stage::detect)] += front_end_.detect_ms();
  out->keyframe = true;
}

bool Odometry::start_scene(const Transform& T_left_world, Stamp stamp, FrameOutcome* out) noexcept {
  StageClock clock(out);
  map_.clear();
  const AcrossCount across = front_end_.add_points(map_, T_left_world, PointStage::active);
  clock.mark(Stage::match);
  if (across.corners < kStartMatches)
    out->reason = Reason::few_features;
  else if (across.near < kCertainShare * across.corners && front_end_.count_exchanged() > across.near)
    out->reason = Reason::cameras_swapped;
  else if (across.matched < kStartMatches || across.matched < kStartShare * across.corners || across.near < kNearEnough)
    out->reason = Reason::no_stereo_matches;
  else {
    across_fails_ = false;
    const std::size_t slot = map_.make_keyframe(T_left_world, stamp);
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
    out->inliers = across.matched;
    out->stereo_inliers = across.matched;
    return true;
  }
  map_.clear();
  return false;
}

bool Odometry::confirmed_across(const PoseFit& fit) noexcept {
  return std::popcount(fit.cameras) >= 2 && fit.stereo >= kAcrossShare * fit.across;
}

Reason Odometry::weakness(const ImageCheck& images) const noexcept {
  const auto all = static_cast<std::uint8_t>((1U << static_cast<unsigned>(rig_.cameras)) - 1U);
  if (images.given != all) return Reason::no_image;
  if (images.repeated) return Reason::image_repeated;
  return images.structured != all ? Reason::image_dark : Reason::none;
}

void Odometry::judge(const PoseFit& fit, const ImageCheck& images, FrameOutcome* out) const noexcept {
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
  else if (across_fails_ || !confirmed_across(fit))
    out->reason = Reason::no_stereo_matches;
  else if (fit.inliers < options_.ok_inliers)
    out->reason = Reason::few_inliers;
  else if (fit.inliers < kRigidShare * fit.given)
    out->reason = Reason::moving_scene;
  else if (fit.weak || fit.near < kNearEnough)
    out->reason = Reason::weak_geometry;
  else {
    out->reason = Reason::none;
    out->status = PoseStatus::ok;
  }
}

FrameOutcome Odometry::process(const RigFrame& frame) noexcept {
  FrameOutcome out;
  StageClock clock(&out);
  const ImageCheck images = front_end_.begin(frame);
  clock.mark(Stage::pyramid);
  const double dt = any_pose_ ? (frame.stamp - stamp_).to_seconds() : 0.0;
  const Transform predicted = any_pose_ ? predict(std::min(dt, kLongestExtrapolation)) : Transform{};

  if (map_.order().empty()) {
    // Nothing to follow: this frame begins a scene, where the last one is thought to have ended.
    if (!start_scene(predicted, frame.stamp, &out)) {
      if (weakness(images) != Reason::none) out.reason = weakness(images);
      return out;
    }
    if (any_pose_) {
      out.restarted = true;
      out.gap_s = dt;
      restart_cooldown_ = kRestartedFrames;
      out.status = PoseStatus::degraded;
      out.reason = Reason::scene_restarted;
    }
    out.T_left_world = predicted;
    remember(predicted, frame.stamp);
    frames_lost_ = 0;
    return out;
  }

  if (dt > options_.max_gap_s && frames_lost_ == 0) out.gap_s = dt;
  const PoseFit fit = track(predicted, images.structured, &out);
  if (!fit.found) {
    out.reason = weakness(images) != Reason::none ? weakness(images) : out.gap_s > 0 ? Reason::time_gap : Reason::no_pose;
    if (images.structured != 0 && ++frames_lost_ >= kFramesLostBeforeRestart) map_.clear();
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
  if (confirmed_across(fit) && !images.repeated && wants_keyframe()) make_keyframe(fit, frame.stamp, &out);
  out.T_left_world = T_left_world_;
  judge(fit, images, &out);
  if (restart_cooldown_ > 0) --restart_cooldown_;
  return out;
}

}  // namespace vergence::odometry
