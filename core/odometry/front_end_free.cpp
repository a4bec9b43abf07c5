#include <algorithm>
#include <array>

#include "core/features/patch.hpp"
#include "core/odometry/front_end.hpp"

/// Matches by descriptors, without a predicted pose or rig.
namespace vergence::odometry {
namespace {

// Maximum ratio of the Hamming distance to the second best, of 256 bits. Unrelated patches have
// distances of 128 ± 8, and so ratios near 1.
constexpr double kDistinct = 0.8;
// Standard deviation in px between two independently detected corners.
constexpr float kRoughSigma = 3.F;

/// The most similar of several descriptors.
struct Nearest {
  std::size_t index = 0;
  // Distances of the most similar and the second.
  int bits = 257, second = 257;
  [[nodiscard]] bool distinct() const noexcept { return bits <= kDistinct * second; }
};

Nearest find_nearest(const features::Descriptor& d,
                     std::span<const features::Descriptor> among) noexcept {
  Nearest nearest;
  for (std::size_t i = 0; i < among.size(); ++i) {
    const int bits = features::distance(d, among[i]);
    if (bits < nearest.bits)
      nearest = {i, bits, nearest.bits};
    else
      nearest.second = std::min(nearest.second, bits);
  }
  return nearest;
}

}  // namespace

void FrontEnd::find_dense_corners(int k) noexcept {
  features::CornerOptions how = corner_options(k);
  // A corner finds its partner if that is the strongest of its cell. At most kMaxPoints corners
  // fit.
  how.cell = std::max(features::kWindow, how.cell / 2);
  how.min_distance = 0.5F * static_cast<float>(how.cell);
  features::find_corners(pyramids_[static_cast<std::size_t>(k)].level(0), how, {}, runner_,
                         &taken_);
}

int FrontEnd::relocalise(Map& map, int k) noexcept {
  const auto c = static_cast<std::size_t>(k);
  const std::span<MapPoint> points = map.points();
  for (MapPoint& p : points) p.now.drop(k);
  if (!has_camera(structured_, k)) return 0;
  // Map index of each descriptor.
  std::array<std::uint16_t, kMaxPoints> owner;
  std::size_t n = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!points[i].constrains_poses()) continue;
    described_[n] = features::describe(points[i].patch);
    owner[n++] = static_cast<std::uint16_t>(i);
  }
  find_dense_corners(k);
  int found = 0;
  features::Patch patch;
  for (const features::Corner& corner : taken_) {
    const Vec2 at(corner.x, corner.y);
    if (!features::cut_patch(pyramids_[c], at, &patch)) continue;
    const features::Descriptor d = features::describe(patch);
    Followed f;
    const Nearest nearest = find_nearest(d, described_.first(n));
    if (!nearest.distinct()) continue;
    MapPoint& p = points[owner[nearest.index]];
    if (p.now.by(k) || !finish(k, at, 0.0, 0.0, &f)) continue;
    f.sigma = kRoughSigma;
    store(f, k, &p);
    ++found;
  }
  return found;
}

std::span<const FreeMatch> FrontEnd::match_free(int k) noexcept {
  free_matches_.clear();
  if (!has_camera(structured_, 0) || !has_camera(structured_, k)) return {};
  if (options_.init_features == 0) {
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
  const features::AlignOptions how{.coarsest = 1, .max_shift = 8.F};
  const features::AlignResult a = features::align(patch, pyramids_[static_cast<std::size_t>(k)],
                                                  rough.other, Mat2::Identity(), how);
  Followed left, other;
  if (a.status != features::AlignStatus::ok || !finish(0, rough.left, 0.0, 0.0, &left) ||
      !finish(k, a.pixel, static_cast<double>(a.sigma), 0.0, &other))
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
  // Per dense corner, the most similar left corner.
  std::array<std::uint16_t, kMaxPoints> owner;
  std::array<std::uint16_t, kMaxPoints> owner_bits;
  owner_bits.fill(256);
  for (std::size_t i = 0; i < corners_.size(); ++i) {
    fresh_[i].usable = false;
    if (!features::cut_patch(pyramids_[0], {corners_[i].x, corners_[i].y}, &fresh_[i].patch))
      continue;
    const Nearest nearest =
        find_nearest(features::describe(fresh_[i].patch), described_.first(taken_.size()));
    const std::size_t j = nearest.index;
    if (!nearest.distinct() || nearest.bits >= owner_bits[j]) continue;
    if (owner_bits[j] < 256) fresh_[owner[j]].usable = false;
    owner[j] = static_cast<std::uint16_t>(i);
    owner_bits[j] = static_cast<std::uint16_t>(nearest.bits);
    fresh_[i].usable = true;
    fresh_[i].matched_camera = static_cast<int>(j);
  }
  for (std::size_t i = 0; i < corners_.size(); ++i) {
    if (!fresh_[i].usable) continue;
    const features::Corner& other = taken_[static_cast<std::size_t>(fresh_[i].matched_camera)];
    keep_free_match(fresh_[i].patch, {{corners_[i].x, corners_[i].y}, {other.x, other.y}}, k);
  }
}

}  // namespace vergence::odometry
