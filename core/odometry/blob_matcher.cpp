#include "core/odometry/blob_matcher.hpp"

namespace vergence::odometry {

BlobMatcher::BlobMatcher(int max_width, int max_height, Arena& arena)
    : surf_(max_width, max_height, arena),
      matcher_(kMaxPoints, arena),
      found_(arena.make<features::SurfMatch>(kMaxPoints, "matches of blobs")),
      matches_(arena.make<RoughMatch>(kMaxPoints, "rough matches")) {
  for (std::size_t k = 0; k < 2; ++k) {
    points_[k] =
        BoundedVector<features::SurfPoint>(arena.make<features::SurfPoint>(kMaxPoints, "blobs"));
    descriptors_[k] = arena.make<features::SurfDescriptor>(kMaxPoints, "descriptors of blobs");
  }
}

features::SurfView BlobMatcher::describe(const ImageView& image, const features::Mask* mask,
                                         std::size_t k) noexcept {
  if (surf_.set_image(image) != features::SurfStatus::ok) return {};
  (void)surf_.detect({.mask = mask}, &points_[k]);
  const std::span<features::SurfDescriptor> descriptors = descriptors_[k].first(points_[k].size());
  surf_.describe(points_[k].span(), descriptors);
  return {points_[k].span(), descriptors};
}

std::span<const RoughMatch> BlobMatcher::match(const ImageView& left,
                                               const features::Mask* left_mask,
                                               const ImageView& other,
                                               const features::Mask* other_mask) noexcept {
  matches_.clear();
  const features::SurfView a = describe(left, left_mask, 0), b = describe(other, other_mask, 1);
  if (matcher_.match(a, b, &found_) != features::SurfMatchStatus::ok) return {};
  const auto pixel = [](const features::SurfPoint& p) noexcept {
    return Vec2(static_cast<double>(p.x), static_cast<double>(p.y));
  };
  for (const features::SurfMatch& m : found_)
    (void)matches_.push({pixel(a.points[m.left]), pixel(b.points[m.right])});
  return matches_.span();
}

}  // namespace vergence::odometry
