#pragma once
#include <array>
#include <cstddef>
#include <span>

#include "core/features/surf_match.hpp"
#include "core/odometry/map.hpp"
#include "core/types/image.hpp"

namespace vergence::odometry {

/// Raw pixels of a tentative match between two images.
struct RoughMatch {
  Vec2 left = Vec2::Zero(), other = Vec2::Zero();
};

/// Matches upright SURF-64 features between two images of unknown relative pose; matches are
/// mutually best. docs/benchmarks.md compares it with corners.
///
/// Threads  One caller.
/// Memory   From the arena at construction. If there are more than kMaxPoints blobs, the weakest
///          are dropped.
/// Errors   Images that are empty or too large give no matches.
class BlobMatcher {
 public:
  BlobMatcher() noexcept = default;
  BlobMatcher(int max_width, int max_height, Arena& arena);

  /// Returns the matches, strongest left blob first; valid until the next call. A mask may be null.
  [[nodiscard]] std::span<const RoughMatch> match(const ImageView& left,
                                                  const features::Mask* left_mask,
                                                  const ImageView& other,
                                                  const features::Mask* other_mask) noexcept;

 private:
  [[nodiscard]] features::SurfView describe(const ImageView& image, const features::Mask* mask,
                                            std::size_t k) noexcept;

  features::Surf surf_;
  features::SurfMatcher matcher_;
  std::array<BoundedVector<features::SurfPoint>, 2> points_{};
  std::array<std::span<features::SurfDescriptor>, 2> descriptors_{};
  BoundedVector<features::SurfMatch> found_;
  BoundedVector<RoughMatch> matches_;
};

}  // namespace vergence::odometry
