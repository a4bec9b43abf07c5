#include "core/odometry/front_end.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "core/features/epipolar_search.hpp"

namespace vergence::odometry {
namespace {

constexpr double kImageMargin = 9.0;   // px: a window's half and one
constexpr float kMinStructure = 3.0F;  // grey levels, standard deviation of the coarsest level: a
                                       // lens cap's noise stays below 2
constexpr double kFarBaselines =
    2000.0;  // depth given to a point whose disparity is within the noise of zero
constexpr int kMaskMargin =
    features::kWindow / 2 + 1;     // px: no pixel that holds a feature is a masked one
constexpr int kSmallestCell = 12;  // px: a window's side; nearer corners share their pixels
constexpr double kDenseCells =
    3500;                          // of an image: below features::kMaxGridCells with their rounding
constexpr int kMaxDistance = 64;   // bits of 256: unrelated patches lie at 128 ± 8
constexpr double kDistinct = 0.8;  // of the second best's distance
constexpr float kRoughSigma = 3.F;  // px: two corners found independently

/// Shape of a patch seen from elsewhere, as if its surface faced the camera it was cut in: ∂(pixel
/// there)/∂(pixel here). X = T (z ray): moving the pixel moves the ray, the depth z stays.
Mat2 warp(const Mat23& d_pixel_d_point, const Mat3& R_there_here, double z,
          const Mat2& d_ray_d_pixel) noexcept {
  return d_pixel_d_point * R_there_here.leftCols<2>() * (z * d_ray_d_pixel);
}

/// Sums over a small image: whether it shows something, and whether it is the one seen before.
FrontEnd::Fingerprint fingerprint(const ImageView& image) noexcept {
  std::int64_t sum = 0, square = 0;
  for (int y = 0; y < image.height; ++y) {
    const std::uint8_t* row = image.row(y);
    for (int x = 0; x < image.width; ++x) {
      sum += row[x];
      square += row[x] * row[x];
    }
  }
  return {sum, square};
}

bool shows_something(const FrontEnd::Fingerprint& f, const ImageView& image) noexcept {
  const double n = static_cast<double>(image.width) * image.height;
  const double mean = static_cast<double>(f.sum) / n;
  return static_cast<double>(f.square) / n - mean * mean >
         static_cast<double>(kMinStructure * kMinStructure);
}

float milliseconds_since(std::chrono::steady_clock::time_point start) noexcept {
  return std::chrono::duration<float, std::milli>(std::chrono::steady_clock::now() - start).count();
}

int largest_width(const RigCalibration& rig) noexcept {
  int w = 0;
  for (int k = 0; k < rig.cameras; ++k)
    w = std::max(w, rig.intrinsics[static_cast<std::size_t>(k)].width);
  return w;
}

int largest_height(const RigCalibration& rig) noexcept {
  int h = 0;
  for (int k = 0; k < rig.cameras; ++k)
    h = std::max(h, rig.intrinsics[static_cast<std::size_t>(k)].height);
  return h;
}

}  // namespace

std::size_t FrontEnd::memory_needed(const OdometryOptions& options, const RigCalibration& rig,
                                    std::span<const ImageView> masks) noexcept {
  std::size_t bytes = 0;
  for (const ImageView& mask : masks)
    if (!mask.empty()) bytes += features::Mask::memory_needed(mask.width, mask.height);
  for (int k = 0; k < rig.cameras; ++k) {
    const Intrinsics& c = rig.intrinsics[static_cast<std::size_t>(k)];
    bytes += features::Pyramid::memory_needed(c.width, c.height, options.pyramid_levels) +
             kMaxPoints * sizeof(Followed) + 2 * kCacheLine;
  }
  if (options.first_pair != 0)
    bytes += BlobMatcher::memory_needed(largest_width(rig), largest_height(rig));
  const auto n = static_cast<std::size_t>(options.features);
  return bytes + n * (sizeof(features::Corner) + sizeof(NewPoint) + sizeof(FreeMatch)) +
         kMaxPoints * (sizeof(features::Corner) + sizeof(features::Descriptor)) + 6 * kCacheLine;
}

FrontEnd::FrontEnd(const OdometryOptions& options, const RigCalibration& rig, Arena& arena,
                   PairRunner& runner, std::span<const ImageView> masks)
    : options_(options),
      rig_(rig),
      runner_(runner),
      cameras_(rig.cameras),
      band_px_(options.band_px) {
  const auto n = static_cast<std::size_t>(options.features);
  for (int k = 0; k < cameras_; ++k) {
    const auto i = static_cast<std::size_t>(k);
    const Intrinsics& c = rig.intrinsics[i];
    pyramids_[i] = features::Pyramid(c.width, c.height, options.pyramid_levels, arena);
    followed_[i] = arena.make<Followed>(kMaxPoints, "followed points");
    if (i < masks.size()) masks_[i] = features::Mask(masks[i], kMaskMargin, arena);
  }
  corners_ = BoundedVector<features::Corner>(arena.make<features::Corner>(n, "corners"));
  taken_ =
      BoundedVector<features::Corner>(arena.make<features::Corner>(kMaxPoints, "taken corners"));
  fresh_ = arena.make<NewPoint>(n, "new points");
  described_ = arena.make<features::Descriptor>(kMaxPoints, "descriptors");
  free_matches_ = BoundedVector<FreeMatch>(arena.make<FreeMatch>(n, "free matches"));
  if (options.first_pair != 0) blobs_ = BlobMatcher(largest_width(rig), largest_height(rig), arena);
  rebuild_lenses();
}

void FrontEnd::rebuild_lenses() noexcept {
  for (int k = 0; k < cameras_; ++k)
    lenses_[static_cast<std::size_t>(k)] =
        UndistortedCamera(rig_.intrinsics[static_cast<std::size_t>(k)]);
}

ImageCheck FrontEnd::begin(const RigFrame& frame) noexcept {
  std::array<bool, kMaxCameras> structured{}, repeated{};
  const auto build = [&](int k) noexcept {
    const auto i = static_cast<std::size_t>(k);
    const ImageView& image = frame.images[i];
    if (image.empty() || image.width != rig_.intrinsics[i].width ||
        image.height != rig_.intrinsics[i].height)
      return;
    pyramids_[i].build(image);
    const ImageView& coarsest = pyramids_[i].level(pyramids_[i].levels() - 1);
    const Fingerprint f = fingerprint(coarsest);
    structured[i] = shows_something(f, coarsest);
    repeated[i] = structured[i] && f == fingerprints_[i];
    fingerprints_[i] = f;
  };
  auto left = [&]() noexcept { build(0); };
  auto others = [&]() noexcept {
    for (int k = 1; k < cameras_; ++k) build(k);
  };
  runner_.run(TaskRef(left), TaskRef(others));
  ImageCheck check;
  for (int k = 0; k < cameras_; ++k) {
    const auto i = static_cast<std::size_t>(k);
    if (!frame.images[i].empty())
      check.given = static_cast<std::uint8_t>(check.given | (1U << static_cast<unsigned>(k)));
    // The left image once more on another line is as impossible as the last one once more.
    if (k > 0 && structured[i] && fingerprints_[i] == fingerprints_[0]) {
      repeated[i] = true;
      structured[i] = false;
    }
    if (repeated[i]) check.repeated = true;
    if (structured[i])
      check.structured =
          static_cast<std::uint8_t>(check.structured | (1U << static_cast<unsigned>(k)));
  }
  structured_ = check.structured;
  return check;
}

bool FrontEnd::finish(int k, const Vec2& raw, double parallax, Followed* f) const noexcept {
  Vec2 ideal;
  double magnification = 1.0;
  if (hides(k, raw) || !lens(k).undistort(raw, &ideal, &magnification)) return false;
  f->found = true;
  f->raw = raw.cast<float>();
  f->ideal = ideal.cast<float>();
  f->sigma = static_cast<float>(
      std::hypot(options_.pixel_sigma, options_.parallax_sigma * parallax) * magnification);
  return true;
}

FrontEnd::Followed FrontEnd::follow(const MapPoint& p, const Transform& T_left_world, int k,
                                    const features::AlignOptions& how) const noexcept {
  Followed f;
  const auto i = static_cast<std::size_t>(k);
  if (!placed(k)) return f;
  const Transform T_k_world = rig_.T_camera_left[i] * T_left_world;
  const Camera& camera = lenses_[i].raw();
  Vec2 predicted;
  Mat23 J;
  if (camera.project(T_k_world * p.p_world, &predicted, &J) != ProjectStatus::ok ||
      !camera.inside(predicted, kImageMargin))
    return f;
  const Transform T_k_origin = T_k_world * p.T_origin_world.inverse();
  const double z = (p.T_origin_world * p.p_world).z();
  const features::AlignResult a = features::align(p.patch, pyramids_[i], predicted,
                                                  warp(J, T_k_origin.R, z, p.d_ray_d_pixel), how);
  if (a.status == features::AlignStatus::ok) (void)finish(k, a.pixel, T_k_origin.t.norm() / z, &f);
  return f;
}

void FrontEnd::store(const Followed& f, int k, MapPoint* p) noexcept {
  p->now.set(k, f.ideal.cast<double>(), f.sigma);
  p->raw[static_cast<std::size_t>(k)] = f.raw;
}

void FrontEnd::follow_into_all(Map& map, const Transform& T_left_world,
                               const features::AlignOptions& how, int stride) noexcept {
  const std::span<MapPoint> points = map.points();
  const auto one = [&](int k) noexcept {
    const auto c = static_cast<std::size_t>(k);
    const bool structured = ((structured_ >> static_cast<unsigned>(k)) & 1U) != 0;
    int active = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      followed_[c][i].found = false;
      if (!structured || !points[i].followed()) continue;
      if (stride > 1 && (points[i].stage != PointStage::active || active++ % stride != 0)) continue;
      followed_[c][i] = follow(points[i], T_left_world, k, how);
    }
  };
  auto left = [&]() noexcept { one(0); };
  auto others = [&]() noexcept {
    for (int k = 1; k < cameras_; ++k) one(k);
  };
  runner_.run(TaskRef(left), TaskRef(others));
  for (std::size_t i = 0; i < points.size(); ++i) {
    points[i].now.cameras = 0;
    for (int k = 0; k < cameras_; ++k)
      if (followed_[static_cast<std::size_t>(k)][i].found)
        store(followed_[static_cast<std::size_t>(k)][i], k, &points[i]);
  }
}

void FrontEnd::follow_sample(Map& map, const Transform& T_left_world, int sample,
                             int coarsest) noexcept {
  int active = 0;
  for (const MapPoint& p : map.points()) active += p.stage == PointStage::active ? 1 : 0;
  features::AlignOptions how;
  how.coarsest = coarsest;
  how.finest = 0;
  how.min_zncc = static_cast<float>(options_.match_zncc);
  how.max_shift = static_cast<float>(8 << coarsest);
  // At least every second: stride 1 would mean the candidates too.
  follow_into_all(map, T_left_world, how, std::max(2, active / std::max(sample, 1)));
}

void FrontEnd::follow_all(Map& map, const Transform& T_left_world) noexcept {
  features::AlignOptions how;
  how.coarsest = 1;
  how.finest = 0;
  how.min_zncc = static_cast<float>(options_.match_zncc);
  how.max_shift = 8.F;
  follow_into_all(map, T_left_world, how, 1);
}

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

void FrontEnd::find_dense_corners(int k) noexcept {
  features::CornerOptions how = corner_options(k);
  // A corner finds its partner if that is among the strongest of its cell; there is room for
  // kMaxPoints of them.
  const Intrinsics& c = rig_.intrinsics[static_cast<std::size_t>(k)];
  const auto least =
      static_cast<int>(std::ceil(std::sqrt(static_cast<double>(c.width) * c.height / kDenseCells)));
  how.cell = std::max({kSmallestCell, how.cell / 2, least});
  how.min_distance = 0.5F * static_cast<float>(how.cell);
  features::find_corners(pyramids_[static_cast<std::size_t>(k)].level(0), how, {}, runner_,
                         &taken_);
}

int FrontEnd::relocalise(Map& map, int k) noexcept {
  const auto c = static_cast<std::size_t>(k);
  const std::span<MapPoint> points = map.points();
  for (MapPoint& p : points) p.now.drop(k);
  if (((structured_ >> static_cast<unsigned>(k)) & 1U) == 0) return 0;
  for (std::size_t i = 0; i < points.size(); ++i)
    if (points[i].holds_poses()) described_[i] = features::describe(points[i].patch);
  find_dense_corners(k);
  int found = 0;
  features::Patch patch;
  for (const features::Corner& corner : taken_) {
    const Vec2 at(corner.x, corner.y);
    if (!features::cut_patch(pyramids_[c], at, &patch)) continue;
    const features::Descriptor d = features::describe(patch);
    int best = kMaxDistance + 1, second = 256;
    std::size_t which = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (!points[i].holds_poses()) continue;
      const int bits = features::distance(d, described_[i]);
      if (bits < best) {
        second = best;
        best = bits;
        which = i;
      } else if (bits < second) {
        second = bits;
      }
    }
    Followed f;
    if (best > kMaxDistance || best > kDistinct * second || points[which].now.by(k) ||
        !finish(k, at, 0.0, &f))
      continue;
    f.sigma = kRoughSigma;
    store(f, k, &points[which]);
    ++found;
  }
  return found;
}

std::span<const FreeMatch> FrontEnd::match_free(int k) noexcept {
  free_matches_.clear();
  if ((structured_ & 1U) == 0 || ((structured_ >> static_cast<unsigned>(k)) & 1U) == 0) return {};
  if (options_.first_pair == 0) {
    match_corners_freely(k);
  } else {
    features::Patch patch;
    const ImageView& other = pyramids_[static_cast<std::size_t>(k)].level(0);
    for (const RoughMatch& m : blobs_.match(pyramids_[0].level(0), mask(0), other, mask(k)))
      if (features::cut_patch(pyramids_[0], m.left, &patch)) keep_free_match(patch, m, k);
  }
  return free_matches_.span();
}

void FrontEnd::keep_free_match(const features::Patch& patch, const RoughMatch& rough,
                               int k) noexcept {
  features::AlignOptions how;
  how.coarsest = 1;
  how.min_zncc = static_cast<float>(options_.match_zncc);
  how.max_shift = 8.F;
  const features::AlignResult a = features::align(patch, pyramids_[static_cast<std::size_t>(k)],
                                                  rough.other, Mat2::Identity(), how);
  Followed left, other;
  if (a.status != features::AlignStatus::ok || !finish(0, rough.left, 0.0, &left) ||
      !finish(k, a.pixel, 0.0, &other))
    return;
  (void)free_matches_.push({left.ideal.cast<double>(), other.ideal.cast<double>(),
                            static_cast<double>(std::max(left.sigma, other.sigma))});
}

void FrontEnd::match_corners_freely(int k) noexcept {
  const auto c = static_cast<std::size_t>(k);
  features::find_corners(pyramids_[0].level(0), corner_options(0), {}, runner_, &corners_);
  find_dense_corners(k);
  features::Patch patch;
  for (std::size_t j = 0; j < taken_.size(); ++j) {
    const bool cut = features::cut_patch(pyramids_[c], {taken_[j].x, taken_[j].y}, &patch);
    described_[j] = cut ? features::describe(patch) : features::Descriptor{};
  }
  // By dense corner: the left corner it resembles most.
  std::array<std::uint16_t, kMaxPoints> owner;
  std::array<std::uint16_t, kMaxPoints> owner_bits;
  owner_bits.fill(256);
  const auto nearest = [&](const features::Descriptor& d, int* second) noexcept {
    std::size_t best = 0;
    int least = 257;
    *second = 257;
    for (std::size_t j = 0; j < taken_.size(); ++j) {
      const int bits = features::distance(d, described_[j]);
      if (bits < least) {
        *second = least;
        least = bits;
        best = j;
      } else if (bits < *second) {
        *second = bits;
      }
    }
    return std::pair(best, least);
  };
  for (std::size_t i = 0; i < corners_.size(); ++i) {
    fresh_[i].usable = false;
    if (!features::cut_patch(pyramids_[0], {corners_[i].x, corners_[i].y}, &fresh_[i].patch))
      continue;
    int second = 0;
    const auto [j, bits] = nearest(features::describe(fresh_[i].patch), &second);
    if (bits > kMaxDistance || bits > kDistinct * second || bits >= owner_bits[j]) continue;
    if (owner_bits[j] < 256) fresh_[owner[j]].usable = false;
    owner[j] = static_cast<std::uint16_t>(i);
    owner_bits[j] = static_cast<std::uint16_t>(bits);
    fresh_[i].usable = true;
    fresh_[i].matched_camera = static_cast<int>(j);
  }
  for (std::size_t i = 0; i < corners_.size(); ++i) {
    if (!fresh_[i].usable) continue;
    const features::Corner& other = taken_[static_cast<std::size_t>(fresh_[i].matched_camera)];
    keep_free_match(fresh_[i].patch, {{corners_[i].x, corners_[i].y}, {other.x, other.y}}, k);
  }
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
                                 const FrameEffort& effort) noexcept {
  StereoCount count;
  const auto start = std::chrono::steady_clock::now();
  taken_.clear();
  for (const MapPoint& p : map.points())
    if (p.followed() && p.now.by(0)) (void)taken_.push({p.raw[0].x(), p.raw[0].y(), 0.F});
  features::find_corners(pyramids_[0].level(0), corner_options(0), taken_.span(), runner_,
                         &corners_);
  const auto room = static_cast<std::size_t>(std::max(
      0, options_.features * effort.points_percent / 100 - static_cast<int>(taken_.size())));
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
