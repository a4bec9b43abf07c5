#include "core/features/surf_match.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/features/detail/surf_distance.hpp"

namespace vergence::features {
namespace {

constexpr float kNone = std::numeric_limits<float>::infinity();

/// True unless the descriptor is zero, as those of all flat neighbourhoods are.
bool described(const SurfDescriptor& d) noexcept { return detail::squared_distance(d, {}) > 0.5F; }

/// Epipolar line of a left point, a x + b y + c = 0 with a² + b² = 1; all zero if it has no
/// direction, so that every point is on it.
Vec3 epipolar_line(const EpipolarBand* band, const SurfPoint& p) noexcept {
  if (band == nullptr) return Vec3::Zero();
  const Vec3 line = band->F * Vec3(static_cast<double>(p.x), static_cast<double>(p.y), 1.0);
  const double length = line.head<2>().norm();
  return length > 0 ? Vec3(line / length) : Vec3(Vec3::Zero());
}

}  // namespace

SurfMatcher::SurfMatcher(std::size_t capacity, Arena& arena)
    : left_(arena.make<Best>(capacity, "matches of left blobs")),
      right_(arena.make<Best>(capacity, "matches of right blobs")) {}

void SurfMatcher::compare(const SurfView& left, const SurfView& right,
                          const EpipolarBand* band) noexcept {
  for (std::size_t j = 0; j < right.points.size(); ++j)
    right_[j] = {0, kNone, kNone, described(right.descriptors[j])};
  for (std::size_t i = 0; i < left.points.size(); ++i) {
    const SurfPoint& p = left.points[i];
    Best& mine = left_[i];
    mine = {0, kNone, kNone, described(left.descriptors[i])};
    if (!mine.described) continue;
    const Vec3 line = epipolar_line(band, p);
    const auto far = [&](const SurfPoint& q) noexcept {
      return band != nullptr &&
             !(std::abs(line.x() * static_cast<double>(q.x) + line.y() * static_cast<double>(q.y) +
                        line.z()) <= band->px);
    };
    for (std::size_t j = 0; j < right.points.size(); ++j) {
      Best& yours = right_[j];
      if (!yours.described || p.dark != right.points[j].dark || far(right.points[j])) continue;
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
                                   const SurfMatchOptions& options, const EpipolarBand* band,
                                   BoundedVector<SurfMatch>* out) noexcept {
  out->clear();
  if (left.points.size() != left.descriptors.size() ||
      right.points.size() != right.descriptors.size())
    return SurfMatchStatus::invalid_input;
  if (left.points.size() > left_.size() || right.points.size() > right_.size())
    return SurfMatchStatus::capacity;
  compare(left, right, band);
  const float most = options.max_distance * options.max_distance,
              ratio = options.ratio * options.ratio;
  for (std::size_t i = 0; i < left.points.size() && !out->full(); ++i) {
    const Best& mine = left_[i];
    // The negated comparisons also reject infinity and NaN.
    if (!(mine.square <= most) || !(mine.square < ratio * mine.second) ||
        right_[mine.partner].partner != i)
      continue;
    (void)out->push({static_cast<std::uint32_t>(i), mine.partner, std::sqrt(mine.square)});
  }
  return SurfMatchStatus::ok;
}

}  // namespace vergence::features
