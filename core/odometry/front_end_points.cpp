#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/features/epipolar_search.hpp"
#include "core/features/patch.hpp"
#include "core/odometry/detail/warp.hpp"
#include "core/odometry/front_end.hpp"

/// New points: corners of `left`, matched along their epipolar lines.
namespace vergence::odometry {
features::CornerOptions FrontEnd::corner_options(int k) const noexcept {
  // The minimum cell has the size of a window; corners nearer to each other share pixels.
  // Number of cells per point: about half of the cells have no usable corner (sky, road).
  constexpr double kCellsAPoint = 1.6;
  const Intrinsics& c = rig_.intrinsics[0];
  features::CornerOptions how;
  how.cell = std::clamp(
      static_cast<int>(std::sqrt(c.width * c.height / (kCellsAPoint * options_.features))),
      features::kWindow, features::kMaxCell);
  how.min_distance = 0.5F * static_cast<float>(how.cell);
  how.mask = mask(k);
  return how;
}

void FrontEnd::match_stereo(const features::Corner& corner, bool swapped,
                            NewPoint* out) const noexcept {
  out->usable = false;
  const Vec2 at(corner.x, corner.y);
  if (!features::cut_patch(pyramids_[0], at, &out->patch)) return;
  if (!finish(0, at, 0.0, 0.0, &out->left)) return;
  for (int k = 1; k < cameras_; ++k) {
    if (!has_camera(structured_, k) || !has_extrinsics(k)) continue;
    const auto i = static_cast<std::size_t>(k);
    // With the cameras swapped, the first image is that of camera k.
    const UndistortedCamera& here = lenses_[swapped ? i : 0];
    if (!here.ray_jacobian(at, &out->ray, &out->d_ray_d_pixel)) continue;
    const Transform& T_k_left = rig_.T_camera_left[i];
    const features::EpipolarCurve curve{&lenses_[swapped ? 0 : i].raw(),
                                        swapped ? T_k_left.inverse() : T_k_left, out->ray};
    const double baseline = rig_.T_camera_left[i].t.norm();
    // Search over the width of the image; two cameras do not both see nearer points.
    const Intrinsics& lens = rig_.intrinsics[i];
    const features::EpipolarSearchOptions search{
        .rho_last = std::max(lens.width, lens.height) / (lens.fx * baseline),
        .band = std::max(1, static_cast<int>(std::lround(0.5 * band_px_))),
        .mask = mask(k)};
    const features::SearchResult s =
        features::search_along(out->patch, pyramids_[i], curve, search);
    if (s.status != features::SearchStatus::ok) continue;
    double rho = s.rho;
    Vec2 foot;
    Mat23 J;
    if (curve.at(rho, &foot, &J) != ProjectStatus::ok) continue;
    const features::AlignOptions how{.coarsest = 1, .max_shift = 6.F};
    // The curve's point is in units of depth 1, so the warp's depth is 1 too.
    const features::AlignResult a =
        features::align(out->patch, pyramids_[i], s.pixel,
                        warp(J, curve.T_camera_left.R, 1.0, out->d_ray_d_pixel), how);
    if (a.status != features::AlignStatus::ok) continue;
    double sigma_per_px = 0;
    const double off = features::fit_inverse_depth(curve, a.pixel, &rho, &sigma_per_px);
    if (off < 0 || off > band_px_) continue;
    out->distance = static_cast<float>(off);
    out->disparity = rho / sigma_per_px;
    // Three sigmas of the difference of two positions, in px.
    const double noise = 3.0 * std::sqrt(2.0) * options_.pixel_sigma;
    if (out->disparity < -noise) continue;
    out->rho = std::max(rho, 1.0 / (kFarBaselines * baseline));
    if (!finish(k, a.pixel, static_cast<double>(a.sigma), out->rho * baseline, &out->stereo))
      continue;
    out->matched_camera = k;
    out->usable = true;
    return;
  }
}

void FrontEnd::match_all(std::span<const features::Corner> corners, bool swapped) noexcept {
  for_each_index(runner_, corners.size(),
                 [&](std::size_t i) noexcept { match_stereo(corners[i], swapped, &fresh_[i]); });
}

void FrontEnd::detect_new(const Map* map, const FrameWorkload& effort, int min_corners) noexcept {
  corners_.clear();
  // Without a left image the pyramid refers to the last one, whose memory may have been released.
  if (!has_camera(structured_, 0)) return;
  taken_.clear();
  if (map != nullptr)
    for (const MapPoint& p : map->points())
      if (p.followed() && p.now.by(0)) (void)taken_.push({p.raw[0].x(), p.raw[0].y(), 0.F});
  features::find_corners(pyramids_[0].level(0), corner_options(0), taken_.span(), runner_,
                         &corners_);
  const auto room = static_cast<std::size_t>(
      std::max(min_corners,
               options_.features * effort.points_percent / 100 - static_cast<int>(taken_.size())));
  if (corners_.size() > room) corners_.truncate(room);
}

StereoCount FrontEnd::match_new() noexcept {
  StereoCount count;

  match_all(corners_.span(), false);
  count.corners = static_cast<int>(corners_.size());
  for (std::size_t i = 0; i < corners_.size(); ++i) {
    if (!fresh_[i].usable) continue;
    ++count.matched;
    if (fresh_[i].disparity > kNearDisparity) ++count.near;
  }
  count.evidence = weigh(-HUGE_VAL);
  return count;
}

EpipolarEvidence FrontEnd::weigh_distances() noexcept {
  return weigh_epipolar_distances(distances_.span(), band_px_,
                                  std::numbers::sqrt2 * options_.pixel_sigma);
}

EpipolarEvidence FrontEnd::weigh(double min_disparity) noexcept {
  distances_.clear();
  for (std::size_t i = 0; i < corners_.size(); ++i)
    if (fresh_[i].usable && fresh_[i].disparity > min_disparity)
      (void)distances_.push(fresh_[i].distance);
  return weigh_distances();
}

EpipolarEvidence FrontEnd::weigh_points(const Map& map) noexcept {
  distances_.clear();
  for (const MapPoint& p : map.points()) {
    if (!p.followed() || !p.now.by(0) || !p.now.by(1)) continue;
    features::EpipolarCurve curve{&lenses_[1].ideal(), rig_.T_camera_left[1], {}};
    double rho = 0, unused = 0;
    if (!lenses_[0].ideal().unproject(p.now.pixel[0].cast<double>(), &curve.ray)) continue;
    const double off =
        features::fit_inverse_depth(curve, p.now.pixel[1].cast<double>(), &rho, &unused);
    // Followed points may be outside the search band; larger distances count as its half width.
    if (off >= 0) (void)distances_.push(static_cast<float>(std::min(off, band_px_)));
  }
  return weigh_distances();
}

bool FrontEnd::swapped() noexcept {
  const double as_given = weigh(kNearDisparity).log_likelihood_ratio;
  match_all(corners_.span(), true);
  const EpipolarEvidence other = weigh(kNearDisparity);
  return other.fits() && other.log_likelihood_ratio > as_given;
}

void FrontEnd::add_points(const Transform& T_left_world, PointStage stage, Map* map) noexcept {
  const Transform T_world_left = T_left_world.inverse();
  map->reuse_slots();
  for (std::size_t i = 0; i < corners_.size(); ++i) {
    const NewPoint& f = fresh_[i];
    if (!f.usable) continue;
    MapPoint* p = map->make_point();
    if (p == nullptr) break;
    p->stage = stage;
    p->p_world = T_world_left * (f.ray / f.rho);
    p->T_origin_world = T_left_world;
    p->ray = f.ray;
    p->d_ray_d_pixel = f.d_ray_d_pixel;
    p->patch = f.patch;
    p->found = 1;
    p->across = true;
    store(f.left, 0, p);
    store(f.stereo, f.matched_camera, p);
    p->in_images = p->now.cameras;
  }
}

}  // namespace vergence::odometry
