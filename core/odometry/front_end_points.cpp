#include <algorithm>
#include <chrono>
#include <cmath>

#include "core/features/epipolar_search.hpp"
#include "core/features/patch.hpp"
#include "core/odometry/detail/warp.hpp"
#include "core/odometry/front_end.hpp"

/// New points: corners of `left`, matched along their epipolar lines.
namespace vergence::odometry {
namespace {

constexpr double kFarBaselines =
    2000.0;  // depth given to a point whose disparity is within the noise of zero

float milliseconds_since(std::chrono::steady_clock::time_point start) noexcept {
  return std::chrono::duration<float, std::milli>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace

features::CornerOptions FrontEnd::corner_options(int k) const noexcept {
  // Half of the cells hold a corner that can be followed and matched: sky, road and the like fill
  // the rest.
  constexpr double kCellsAPoint = 1.6;
  const Intrinsics& c = rig_.intrinsics[0];
  features::CornerOptions how;
  how.cell = std::clamp(
      static_cast<int>(std::sqrt(c.width * c.height / (kCellsAPoint * options_.features))),
      kSmallestCell, features::kMaxCell);
  how.min_score = static_cast<float>(options_.min_corner_score);
  how.min_distance = 0.5F * static_cast<float>(how.cell);
  how.mask = mask(k);
  return how;
}

void FrontEnd::match_stereo(const features::Corner& corner, bool exchanged,
                            NewPoint* out) const noexcept {
  out->usable = false;
  out->behind = false;
  const Vec2 at(corner.x, corner.y);
  if (!features::cut_patch(pyramids_[0], at, &out->patch)) return;
  if (!lenses_[0].ray_jacobian(at, &out->ray, &out->d_ray_d_pixel)) return;
  if (!finish(0, at, 0.0, &out->left)) return;
  for (int k = 1; k < cameras_; ++k) {
    if (((structured_ >> static_cast<unsigned>(k)) & 1U) == 0 || !placed(k)) continue;
    const auto i = static_cast<std::size_t>(k);
    const features::EpipolarCurve curve{&lenses_[i].raw(), rig_.T_camera_left[i], out->ray};
    const double baseline = rig_.T_camera_left[i].t.norm();
    features::EpipolarSearchOptions search;
    search.level = 1;
    search.band = std::max(1, static_cast<int>(std::lround(0.5 * band_px_)));
    search.mask = mask(k);
    search.rho_last = (exchanged ? -1.0 : 1.0) / (options_.nearest_baselines * baseline);
    const features::SearchResult s =
        features::search_along(out->patch, pyramids_[i], curve, search);
    if (s.status != features::SearchStatus::ok) continue;
    double rho = s.rho;
    Vec2 foot;
    Mat23 J;
    if (curve.at(rho, &foot, &J) != ProjectStatus::ok) continue;
    features::AlignOptions how;
    how.coarsest = 1;
    how.min_zncc = static_cast<float>(options_.match_zncc);
    how.max_shift = 6.F;
    // The curve's point is in units of depth 1, so the warp's depth is 1 too.
    const features::AlignResult a =
        features::align(out->patch, pyramids_[i], s.pixel,
                        warp(J, curve.T_camera_left.R, 1.0, out->d_ray_d_pixel), how);
    if (a.status != features::AlignStatus::ok) continue;
    double sigma_per_px = 0;
    const double off = features::fit_inverse_depth(curve, a.pixel, &rho, &sigma_per_px);
    if (off < 0 || off > band_px_) continue;
    out->disparity = rho / sigma_per_px;
    const double noise = 3.0 * std::sqrt(2.0) *
                         options_.pixel_sigma;  // px, three sigmas of a difference of two positions
    if (exchanged) {
      out->behind = out->disparity < -kNearDisparity;
      return;
    }
    if (out->disparity < -noise) continue;
    out->rho = std::max(rho, 1.0 / (kFarBaselines * baseline));
    if (!finish(k, a.pixel, out->rho * baseline, &out->stereo)) continue;
    out->matched_camera = k;
    out->usable = true;
    return;
  }
}

void FrontEnd::match_all(std::span<const features::Corner> corners, bool exchanged) noexcept {
  const std::size_t half = corners.size() / 2;
  auto first = [&]() noexcept {
    for (std::size_t i = 0; i < half; ++i) match_stereo(corners[i], exchanged, &fresh_[i]);
  };
  auto second = [&]() noexcept {
    for (std::size_t i = half; i < corners.size(); ++i)
      match_stereo(corners[i], exchanged, &fresh_[i]);
  };
  runner_.run(TaskRef(first), TaskRef(second));
}

StereoCount FrontEnd::add_points(Map& map, const Transform& T_left_world, PointStage stage,
                                 const FrameEffort& effort, int at_least) noexcept {
  StereoCount count;
  corners_.clear();
  // Without a left image the pyramid still looks at the last one, whose memory its camera may have
  // taken back.
  if ((structured_ & 1U) == 0) return count;
  const auto start = std::chrono::steady_clock::now();
  taken_.clear();
  for (const MapPoint& p : map.points())
    if (p.followed() && p.now.by(0)) (void)taken_.push({p.raw[0].x(), p.raw[0].y(), 0.F});
  features::find_corners(pyramids_[0].level(0), corner_options(0), taken_.span(), runner_,
                         &corners_);
  const auto room = static_cast<std::size_t>(std::max(
      at_least, options_.features * effort.points_percent / 100 - static_cast<int>(taken_.size())));
  if (corners_.size() > room) corners_.truncate(room);
  detect_ms_ = milliseconds_since(start);

  count.corners = static_cast<int>(corners_.size());
  match_all(corners_.span(), false);
  const Transform T_world_left = T_left_world.inverse();
  for (std::size_t i = 0; i < corners_.size(); ++i) {
    const NewPoint& f = fresh_[i];
    if (!f.usable) continue;
    ++count.matched;
    if (f.disparity > kNearDisparity) ++count.near;
    MapPoint* p = map.make_point();
    if (p == nullptr) break;
    p->stage = stage;
    p->p_world = T_world_left * (f.ray / f.rho);
    p->T_origin_world = T_left_world;
    p->ray = f.ray;
    p->d_ray_d_pixel = f.d_ray_d_pixel;
    p->patch = f.patch;
    p->found = 1;
    store(f.left, 0, p);
    store(f.stereo, f.matched_camera, p);
    p->in_images = p->now.cameras;
  }
  return count;
}

int FrontEnd::count_exchanged() noexcept {
  match_all(corners_.span(), true);
  int n = 0;
  for (std::size_t i = 0; i < corners_.size(); ++i) n += fresh_[i].behind ? 1 : 0;
  return n;
}

}  // namespace vergence::odometry
