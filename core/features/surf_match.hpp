#pragma once
#include <cstdint>
#include <span>

#include "core/features/surf.hpp"
#include "core/math/types.hpp"

namespace vergence::features {

/// Points and their descriptors, one image's. Views.
struct SurfView {
  std::span<const SurfPoint> points;
  std::span<const SurfDescriptor> descriptors;  // as many
};

struct SurfMatch {
  std::uint32_t left = 0, right = 0;  // indices of the points
  float distance = 0;                 // Euclidean, of unit vectors: 0 … 2
};

/// Where a left point's partner may lie: within `px` of its epipolar line, pixel_rightᵀ F
/// pixel_left = 0. F is of pixels as the points are; a lens that distorts asks for a wider band.
struct EpipolarBand {
  Mat3 F = Mat3::Zero();
  double px = 0;  // half width
};

struct SurfMatchOptions {
  float ratio = 0.8F;         // of the second best's distance that the best may have
  float max_distance = 0.6F;  // unrelated descriptors lie some 0.8 apart
};

enum class SurfMatchStatus : std::uint8_t {
  ok,
  invalid_input,  // points without descriptors
  capacity,       // more points than given to the constructor; nothing matched
};

/// Mutually best partners among blobs of the same sign.
///
/// Source     Nearest neighbour and its ratio to the second: Bay et al. 2008, Lowe 2004; mutual:
///            best in both directions.
/// Threads    One at a time.
/// Memory     From the arena at construction. Matches that find no room are dropped: those of the
///            last left points.
/// Time       Some 64 multiplications a pair of points of equal sign (inside the band).
/// Errors     Not `ok`: *out is empty.
class SurfMatcher {
 public:
  SurfMatcher() noexcept = default;
  /// At most `capacity` points in either image. Throws std::length_error when the arena is full.
  SurfMatcher(std::size_t capacity, Arena& arena);
  [[nodiscard]] static std::size_t memory_needed(std::size_t capacity) noexcept;

  /// In the order of the left points. `band` may be null.
  [[nodiscard]] SurfMatchStatus match(const SurfView& left, const SurfView& right,
                                      const SurfMatchOptions& options, const EpipolarBand* band,
                                      BoundedVector<SurfMatch>* out) noexcept;

 private:
  struct Best {
    std::uint32_t partner = 0;
    float square = 0, second = 0;  // distances
    bool described = false;
  };
  void compare(const SurfView& left, const SurfView& right, const EpipolarBand* band) noexcept;

  std::span<Best> left_, right_;  // of each point
};

}  // namespace vergence::features
