#include "core/odometry/odometry.hpp"

#include <algorithm>
#include <bit>
#include <utility>

#include "core/math/robust.hpp"
#include "core/odometry/detail/frame_steps.hpp"
#include "core/odometry/drift_covariance.hpp"

namespace vergence::odometry {

namespace {

// Number of frames without new points after which some are tried: a standing rig makes no
// keyframes, and a rig that follows a truck at its own speed seems to stand.
constexpr int kFramesUntilTrial = 3;

}  // namespace

Odometry::Odometry(const OdometryOptions& options, const RigCalibration& rig, bool known,
                   Arena& arena, PairRunner& runner, std::span<const ImageView> masks)
    : options_(options),
      rig_(rig),
      link_(known ? Link::linked : Link::unlinked),
      rig_known_(known),
      front_end_(options, rig_, arena, runner, masks),
      map_(static_cast<std::size_t>(options.window_keyframes), arena),
      window_(options, rig_, arena, runner),
      poses_(options, rig_, arena),
      initialiser_(static_cast<std::size_t>(options.features), options.seed, arena) {
  if (known) return;
  unlink();
  reset_extrinsics();
}

void Odometry::link(const RigCalibration& rig) noexcept { next_rig_ = rig; }

void Odometry::unlink() noexcept {
  if (link_ == Link::linked) last_rig_ = rig_;
  link_ = Link::unlinked;
  gaps_.clear_rebuild();
  next_rig_.reset();
  // The transform is only measured in this frame, with about the error of a calibration.
  front_end_.set_band(2 * options_.band_px);
}

bool Odometry::needs_keyframe() const noexcept {
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
  return median(std::span(turn).first(n)) > options_.keyframe_parallax * rig_.intrinsics[0].fx;
}

double Odometry::update_scale(std::size_t slot) noexcept {
  const double length = map_.keyframe(slot).T_camera_left[1].t.norm();
  if (!(length > 0.1 * rig_.baseline && length < 10.0 * rig_.baseline)) return 1.0;
  const double factor = rig_.baseline / length;
  const Vec3 here = map_.keyframe(slot).T_left_world.centre();
  map_.scale_about(here, factor);
  motion_.scale(factor);
  return factor;
}

void Odometry::make_keyframe(Stamp stamp, FrameOutcome* out) noexcept {
  StageClock clock(out);
  const std::size_t slot = map_.make_keyframe({motion_.T_left_world(), rig_.T_camera_left, stamp});
  (void)map_.observe(slot);
  const bool linked = link_ == Link::linked;
  const WindowOutcome window = window_.adjust(map_, linked, out->effort);
  if (linked) {
    if (window.usable) rig_.T_camera_left = window_.T_camera_left();
    out->corrected = map_.keyframe(slot).T_left_world * motion_.T_left_world().inverse();
  } else {
    out->scale = update_scale(slot);
    rig_.T_camera_left = map_.keyframe(slot).T_camera_left;
  }
  motion_.correct(map_.keyframe(slot).T_left_world);
  const auto keyframes = std::min<std::size_t>(map_.order().size(), out->effort.window_keyframes);
  budget_.add_window_time(static_cast<double>(clock.mark(Stage::window)),
                          static_cast<int>(keyframes), window.steps);
  budget_.add_points_time(new_points(0, out), out->effort);
  keyframe_points_ = map_.observe(slot);
  out->keyframe = true;
}

double Odometry::new_points(int min_corners, FrameOutcome* out) noexcept {
  StageClock clock(out);
  front_end_.detect_new(&map_, out->effort, min_corners);
  const float detect_ms = clock.mark(Stage::detect);
  (void)front_end_.match_new();
  front_end_.add_points(motion_.T_left_world(), PointStage::candidate, &map_);
  return static_cast<double>(detect_ms + clock.mark(Stage::match));
}

void Odometry::assess_frame(const PoseFit& fit, const ImageCheck& images,
                            FrameOutcome* out) noexcept {
  out->status = PoseStatus::degraded;
  // New points need a calibration.
  out->moving = others_move_ || (link_ == Link::linked && new_points_.lost());
  const Reason of_images = weakness(images, rig_.cameras);
  if (of_images != Reason::none)
    out->reason = of_images;
  else if (out->gap_s > 0 || gaps_.rebuild_due())
    out->reason = Reason::time_gap;
  else if (std::popcount(fit.cameras) < 2)
    out->reason = Reason::single_camera;
  else if (stereo_fails_ || !fit.confirmed_stereo())
    out->reason = Reason::no_stereo_matches;
  // At a wrong place, for example a period of a regular texture away, most points fit, but much
  // worse than their noise.
  else if (fit.inliers < options_.ok_inliers || fit.scale > kOutlierSigmas)
    out->reason = Reason::few_inliers;
  else if (fit.near < kMinAgreeing)
    out->reason = Reason::weak_geometry;
  else if (link_ == Link::unlinked)
    out->reason = Reason::uncalibrated;
  else {
    out->reason = Reason::none;
    out->status = PoseStatus::ok;
  }
}

FrameOutcome Odometry::process(const RigFrame& frame, Duration budget) noexcept {
  FrameOutcome out;
  StageClock clock(&out);
  budget_.begin(budget);
  const ImageCheck images = front_end_.begin(frame);
  clock.mark(Stage::pyramid);
  const Reason of_images = weakness(images, rig_.cameras);
  out.structured = images.structured;
  out.images_good = of_images == Reason::none;
  out.uneven = images.uneven;
  const double since_frame = gaps_.since_frame(frame.stamp);
  const double dt = motion_.any() ? (frame.stamp - motion_.stamp()).to_seconds() : 0.0;
  const Transform predicted =
      motion_.any() ? motion_.predict(std::min(dt, kLongestExtrapolation)) : Transform{};

  if (map_.order().empty()) {
    if (next_rig_) {
      adopt(*std::exchange(next_rig_, std::nullopt));
      out.relinked = true;
    }
    begin_map(frame, images, predicted, dt, &out);
    if (out.posed) front_end_.keep_left_image();
    return out;
  }

  out.gap_s = gaps_.check(frames_lost_ == 0 ? dt : since_frame, link_ == Link::linked);
  const PoseFit fit = track(predicted, images.structured, &out);
  if (!fit.found) {
    out.reason = of_images != Reason::none ? of_images
                 : out.gap_s > 0           ? Reason::time_gap
                                           : Reason::no_pose;
    if (images.structured != 0 && ++frames_lost_ > kMissesAllowed) {
      map_.clear();
      // Without a calibration the rig must be initialised again.
      if (link_ == Link::unlinked) reset_extrinsics();
    }
    return out;
  }
  settle_points(fit);
  front_end_.keep_left_image();
  frames_lost_ = 0;
  out.posed = true;
  out.inliers = fit.inliers;
  out.stereo_inliers = fit.stereo;
  out.reprojection_px = fit.rms_px;
  out.fit_covariance = fit.covariance;
  // A repeated image contains no information about motion: the velocity is kept, and the motion
  // that it predicts is reported as expected, not seen.
  if (images.left_repeated)
    out.expect(dt, predicted * motion_.T_left_world().inverse());
  else
    motion_.update(fit.T_left_world, frame.stamp);
  out.T_left_world = motion_.T_left_world();
  assess_frame(fit, images, &out);
  const FrameWorkload effort =
      frame.effort ? *frame.effort
                   : budget_.plan(static_cast<int>(map_.order().size()) + 1, options_.window_steps);
  // A map can continue with far points only, but it must not be rebuilt from them.
  const bool all_far = link_ == Link::linked && fit.confirmed_stereo() && fit.near < kMinAgreeing;
  if (next_rig_ && out.images_good) {
    out.relink_due = true;
    out.effort.points_percent = effort.points_percent;
  } else if (gaps_.rebuild_due() && out.images_good && fit.confirmed_stereo() && !all_far) {
    out.map_rebuild_due = true;
  } else if (fit.confirmed_stereo() && !images.repeated && needs_keyframe()) {
    out.effort = effort;
    make_keyframe(frame.stamp, &out);
    out.T_left_world = motion_.T_left_world();
  } else if (frames_untried_ >= kFramesUntilTrial && out.images_good && link_ == Link::linked) {
    trial_ = true;
    frames_untried_ = 0;
    out.effort.points_percent = effort.points_percent;
    // As many points as an `ok` pose needs suffice for an evaluation, whatever the time budget.
    (void)new_points(options_.ok_inliers, &out);
  }
  return out;
}

}  // namespace vergence::odometry
