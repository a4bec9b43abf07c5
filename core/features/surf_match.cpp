#include "core/features/surf_match.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/features/detail/surf_distance.hpp"

namespace vergence::features {
namespace {

// Maximum ratio of the best to the second best distance (Lowe 2004).
constexpr float kMaxRatio = 0.8F;
// Maximum distance; that of unrelated descriptors is about 0.8.
constexpr float kMaxDistance = 0.6F;
constexpr float kNone = std::numeric_limits<float>::infinity();

/// True unless the descriptor is zero, as those of all flat neighbourhoods are.
bool described(const SurfDescriptor& d) noexcept { return detail::squared_distance(d, {}) > 0.5F; }

}  // namespace

SurfMatcher::SurfMatcher(std::size_t capacity, Arena& arena)
    : left_(arena.make<Best>(capacity, "matches of left blobs")),
      right_(arena.make<Best>(capacity, "matches of right blobs")) {}

void SurfMatcher::compare(const SurfView& left, const SurfView& right) noexcept {
  for (std::size_t j = 0; j < right.points.size(); ++j)
    right_[j] = {0, kNone, kNone, described(right.descriptors[j])};
  for (std::size_t i = 0; i < left.points.size(); ++i) {
    const SurfPoint& p = left.points[i];
    Best& mine = left_[i];
    mine = {0, kNone, kNone, described(left.descriptors[i])};
    if (!mine.described) continue;
    for (std::size_t j = 0; j < right.points.size(); ++j) {
      Best& yours = right_[j];
      if (!yours.described || p.dark != right.points[j].dark) continue;
      const float square = detail::squared_distance(left.descriptors[i], right.descriptors[j]);
      if (square < yours.square) {
        yours.square = square;
        yours.partner = static_cast<std::uint32_t>(i);
      }
      if (square < mine.square) {
        mine.second = mine.square;
        mine.square = square;
        mine.partner = static_cast<std::uint32_t>(j);
      } else {
        mine.second = std::min(mine.second, square);
      }
    }
  }
}

SurfMatchStatus SurfMatcher::match(const SurfView& left, const SurfView& right,
                                   BoundedVector<SurfMatch>* out) noexcept {
  out->clear();
  if (left.points.size() != left.descriptors.size() ||
      right.points.size() != right.descriptors.size())
    return SurfMatchStatus::invalid_input;
  if (left.points.size() > left_.size() || right.points.size() > right_.size())
    return SurfMatchStatus::capacity;
  compare(left, right);
  for (std::size_t i = 0; i < left.points.size() && !out->full(); ++i) {
    const Best& mine = left_[i];
    // The negated comparisons also reject infinity and NaN.
    if (!(mine.square <= kMaxDistance * kMaxDistance) ||
        !(mine.square < kMaxRatio * kMaxRatio * mine.second) || right_[mine.partner].partner != i)
      continue;
    (void)out->push({static_cast<std::uint32_t>(i), mine.partner, std::sqrt(mine.square)});
  }
  return SurfMatchStatus::ok;
}

}  // namespace vergence::features
