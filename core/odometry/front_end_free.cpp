#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "core/features/patch.hpp"
#include "core/odometry/front_end.hpp"

/// Matches by descriptors, without a predicted pose or rig.
namespace vergence::odometry {
namespace {

// Target number of cells of an image, which stays below features::kMaxGridCells after rounding.
constexpr double kDenseCells = 3500;
// Maximum Hamming distance of 256 bits; unrelated patches have 128 ± 8.
constexpr int kMaxDistance = 64;
// Maximum ratio to the second best distance.
constexpr double kDistinct = 0.8;
// Standard deviation in px between two independently detected corners.
constexpr float kRoughSigma = 3.F;

}  // namespace

void FrontEnd::find_dense_corners(int k) noexcept {
  features::CornerOptions how = corner_options(k);
  // A corner finds its partner if that is the strongest of its cell. At most kMaxPoints corners
  // fit.
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
        !finish(k, at, 0.0, 0.0, &f))
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
  features::AlignOptions how;
  how.coarsest = 1;
  how.min_zncc = kMayMatch;
  how.max_shift = 8.F;
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

}  // namespace vergence::odometry
