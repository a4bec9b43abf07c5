#include "core/odometry/front_end.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <functional>
#include <string_view>

#include "core/features/image_shift.hpp"
#include "core/features/patch.hpp"
#include "core/odometry/detail/warp.hpp"

namespace vergence::odometry {
namespace {

// Minimum standard deviation of the coarsest level in grey levels; a lens cap's noise stays below
// 2.
constexpr float kMinStructure = 3.0F;
// Margin of masks in pixels, so that no feature contains a masked pixel.
constexpr int kMaskMargin = features::kWindow / 2 + 1;

/// Fingerprint of a small image, to detect structure and repetition.
FrontEnd::Fingerprint fingerprint(const ImageView& image) noexcept {
  std::int64_t sum = 0, square = 0;
  std::size_t hash = 0;
  for (int y = 0; y < image.height; ++y) {
    const std::uint8_t* row = image.row(y);
    for (int x = 0; x < image.width; ++x) {
      sum += row[x];
      square += row[x] * row[x];
    }
    const std::string_view bytes(reinterpret_cast<const char*>(row),
                                 static_cast<std::size_t>(image.width));
    hash = std::rotl(hash, 1) ^ std::hash<std::string_view>{}(bytes);
  }
  return {sum, square, hash};
}

bool shows_something(const FrontEnd::Fingerprint& f, const ImageView& image) noexcept {
  const double n = static_cast<double>(image.width) * image.height;
  const double mean = static_cast<double>(f.sum) / n;
  return static_cast<double>(f.square) / n - mean * mean >
         static_cast<double>(kMinStructure * kMinStructure);
}

}  // namespace

FrontEnd::FrontEnd(const OdometryOptions& options, const RigCalibration& rig, Arena& arena,
                   PairRunner& runner, std::span<const ImageView> masks)
    : options_(options),
      rig_(rig),
      runner_(runner),
      cameras_(rig.cameras),
      band_px_(options.band_px) {
  const auto n = static_cast<std::size_t>(options.features);
  int width = 0, height = 0;
  for (int k = 0; k < cameras_; ++k) {
    const auto i = static_cast<std::size_t>(k);
    const Intrinsics& c = rig.intrinsics[i];
    width = std::max(width, c.width);
    height = std::max(height, c.height);
    pyramids_[i] = features::Pyramid(c.width, c.height, options.pyramid_levels, arena);
    followed_[i] = arena.make<Followed>(kMaxPoints, "followed points");
    if (i < masks.size()) masks_[i] = features::Mask(masks[i], kMaskMargin, arena);
  }
  corners_ = BoundedVector<features::Corner>(arena.make<features::Corner>(n, "corners"));
  taken_ =
      BoundedVector<features::Corner>(arena.make<features::Corner>(kMaxPoints, "taken corners"));
  fresh_ = arena.make<NewPoint>(n, "new points");
  distances_ = BoundedVector<float>(arena.make<float>(kMaxPoints, "distances to epipolar lines"));
  described_ = arena.make<features::Descriptor>(kMaxPoints, "descriptors");
  free_matches_ = BoundedVector<FreeMatch>(arena.make<FreeMatch>(n, "free matches"));
  if (options.init_features != 0) blobs_ = BlobMatcher(width, height, arena);
  const int shrink = 1 << (pyramids_[0].levels() - 1);
  kept_ =
      arena.make<std::uint8_t>(static_cast<std::size_t>((rig.intrinsics[0].width / shrink + 1) *
                                                        (rig.intrinsics[0].height / shrink + 1)),
                               "left image before");
  rebuild_lenses();
}

void FrontEnd::keep_left_image() noexcept {
  if (!has_camera(structured_, 0)) return;
  const ImageView& coarsest = pyramids_[0].level(pyramids_[0].levels() - 1);
  for (int y = 0; y < coarsest.height; ++y)
    std::copy_n(coarsest.row(y), coarsest.width, kept_.begin() + y * coarsest.width);
}

Mat3 FrontEnd::turn_since_kept() const noexcept {
  if (!has_camera(structured_, 0)) return Mat3::Identity();
  const int l = pyramids_[0].levels() - 1;
  const ImageView& now = pyramids_[0].level(l);
  const Vec2 shift = std::ldexp(1.0, l) *
                     features::image_shift({kept_.data(), now.width, now.height, now.width}, now);
  const Intrinsics& lens = rig_.intrinsics[0];
  return exp_so3({-shift.y() / lens.fy, shift.x() / lens.fx, 0});
}

void FrontEnd::rebuild_lenses() noexcept {
  for (int k = 0; k < cameras_; ++k)
    lenses_[static_cast<std::size_t>(k)] =
        UndistortedCamera(rig_.intrinsics[static_cast<std::size_t>(k)]);
}

ImageCheck FrontEnd::begin(const RigFrame& frame) noexcept {
  std::array<bool, kMaxCameras> structured{}, repeated{};
  const auto build = [&](std::size_t i) noexcept {
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
  for_each_index(runner_, static_cast<std::size_t>(cameras_), build);
  ImageCheck check;
  bool any_new = false;
  for (int k = 0; k < cameras_; ++k) {
    const auto i = static_cast<std::size_t>(k);
    if (!frame.images[i].empty()) add_camera(&check.given, k);
    // A copy of the left image from another camera is as impossible as a repeated image.
    if (k > 0 && structured[i] && fingerprints_[i] == fingerprints_[0]) {
      repeated[i] = true;
      structured[i] = false;
    }
    if (repeated[i]) check.repeated = true;
    if (structured[i] && !repeated[i]) any_new = true;
    // The pose is the one at the instant of the left image; only images of that instant measure it.
    if (k > 0 && repeated[i] != repeated[0]) structured[i] = false;
    if (structured[i]) add_camera(&check.structured, k);
  }
  check.left_repeated = repeated[0];
  check.uneven = check.repeated && any_new;
  structured_ = check.structured;
  return check;
}

bool FrontEnd::finish(int k, const Vec2& raw, double by_noise, double parallax,
                      Followed* f) const noexcept {
  Vec2 ideal;
  double magnification = 1.0;
  if (hides(k, raw) || !lens(k).undistort(raw, &ideal, &magnification)) return false;
  f->found = true;
  f->raw = raw.cast<float>();
  f->ideal = ideal.cast<float>();
  // `by_noise` is for a noise of one grey level, which is about that of a sensor in daylight.
  f->sigma = static_cast<float>(
      std::hypot(options_.pixel_sigma, by_noise, options_.parallax_sigma * parallax) *
      magnification);
  return true;
}

FrontEnd::Followed FrontEnd::follow(const MapPoint& p, const Transform& T_left_world, int k,
                                    const features::AlignOptions& how) const noexcept {
  Followed f;
  const auto i = static_cast<std::size_t>(k);
  if (!has_extrinsics(k)) return f;
  const Transform T_k_world = rig_.T_camera_left[i] * T_left_world;
  const Camera& camera = lenses_[i].raw();
  Vec2 predicted;
  Mat23 J;
  if (camera.project(T_k_world * p.p_world, &predicted, &J) != ProjectStatus::ok ||
      !camera.inside(predicted, kImageMargin))
    return f;
  const Transform T_k_origin = T_k_world * p.T_origin_world.inverse();
  const double z = (p.T_origin_world * p.p_world).z();
  const Mat2 A = warp(J, T_k_origin.R, z, p.d_ray_d_pixel);
  features::AlignResult a = features::align(p.patch, pyramids_[i], predicted, A, how);
  // From a good prediction the finest level suffices; otherwise try a coarser one, which has a
  // larger range.
  if (a.status != features::AlignStatus::ok && how.coarsest == 0) {
    features::AlignOptions farther = how;
    ++farther.coarsest;
    farther.max_shift *= 2;
    a = features::align(p.patch, pyramids_[i], predicted, A, farther);
  }
  if (a.status == features::AlignStatus::ok)
    (void)finish(k, a.pixel, static_cast<double>(a.sigma), T_k_origin.t.norm() / z, &f);
  return f;
}

void FrontEnd::store(const Followed& f, int k, MapPoint* p) noexcept {
  p->now.set(k, f.ideal.cast<double>(), f.sigma);
  p->raw[static_cast<std::size_t>(k)] = f.raw;
}

void FrontEnd::follow_into_all(Map& map, const Transform& T_left_world, int coarsest,
                               float max_shift, int stride) noexcept {
  const features::AlignOptions how{.coarsest = coarsest, .max_shift = max_shift};
  const std::span<MapPoint> points = map.points();
  std::array<std::uint16_t, kMaxPoints> chosen;
  std::size_t n = 0;
  int active = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (std::span<Followed>& of_camera : followed_)
      if (!of_camera.empty()) of_camera[i].found = false;
    if (!points[i].followed()) continue;
    if (stride > 1 && (points[i].stage != PointStage::active || active++ % stride != 0)) continue;
    chosen[n++] = static_cast<std::uint16_t>(i);
  }
  for_each_index(runner_, n * static_cast<std::size_t>(cameras_), [&](std::size_t j) noexcept {
    const std::size_t k = j / n, i = chosen[j % n];
    const int camera = static_cast<int>(k);
    if (has_camera(structured_, camera))
      followed_[k][i] = follow(points[i], T_left_world, camera, how);
  });
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
  // Use a stride of at least 2, because stride 1 would include the candidates.
  follow_into_all(map, T_left_world, coarsest, static_cast<float>(8 << coarsest),
                  std::max(2, active / std::max(sample, 1)));
}

void FrontEnd::follow_all(Map& map, const Transform& T_left_world) noexcept {
  follow_into_all(map, T_left_world, 0, 4.F, 1);
}

}  // namespace vergence::odometry
