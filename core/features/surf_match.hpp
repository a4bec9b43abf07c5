#pragma once
#include <cstdint>
#include <span>

#include "core/features/surf.hpp"
#include "core/math/types.hpp"

namespace vergence::features {

/// Views of the points of one image and as many descriptors.
struct SurfView {
  std::span<const SurfPoint> points;
  std::span<const SurfDescriptor> descriptors;
};

struct SurfMatch {
  std::uint32_t left = 0, right = 0;
  /// Euclidean distance of unit vectors, 0 … 2.
  float distance = 0;
};

/// Band of width ±px around a left point's epipolar line, in which its partner must be:
/// pixel_rightᵀ F pixel_left = 0. F is for the points' pixels; a lens with distortion needs a wider
/// band.
struct EpipolarBand {
  Mat3 F = Mat3::Zero();
  double px = 0;
};

struct SurfMatchOptions {
  /// Maximum ratio of the best to the second best distance.
  float ratio = 0.8F;
  /// Maximum distance; that of unrelated descriptors is about 0.8.
  float max_distance = 0.6F;
};

enum class SurfMatchStatus : std::uint8_t {
  ok,
  /// The numbers of points and descriptors differ.
  invalid_input,
  /// There are more points than given to the constructor; nothing was matched.
  capacity,
};

/// Matches blobs of the same sign that are mutually best.
///
/// Source     Nearest neighbour and its ratio to the second best: Bay et al. 2008, Lowe 2004; best
///            in both directions.
/// Threads    One caller.
/// Memory     From the arena at construction. If the output is full, matches of the last left
///            points are dropped.
/// Time       About 64 multiplications per pair of points of equal sign (in the band).
/// Errors     If the result is not `ok`, *out is empty.
class SurfMatcher {
 public:
  SurfMatcher() noexcept = default;
  /// `capacity`: maximum number of points in either image. Throws std::length_error if the arena is
  /// full.
  SurfMatcher(std::size_t capacity, Arena& arena);

  /// Matches are in the order of the left points. `band` may be null.
  [[nodiscard]] SurfMatchStatus match(const SurfView& left, const SurfView& right,
                                      const SurfMatchOptions& options, const EpipolarBand* band,
                                      BoundedVector<SurfMatch>* out) noexcept;

 private:
  struct Best {
    std::uint32_t partner = 0;
    // Squared distances of the best and the second best.
    float square = 0, second = 0;
    bool described = false;
  };
  void compare(const SurfView& left, const SurfView& right, const EpipolarBand* band) noexcept;

  std::span<Best> left_, right_;
};

}  // namespace vergence::features
