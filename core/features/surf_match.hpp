#pragma once
#include <cstdint>
#include <span>

#include "core/features/surf.hpp"

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
/// Time       About 64 multiplications per pair of points of equal sign.
/// Errors     If the result is not `ok`, *out is empty.
class SurfMatcher {
 public:
  SurfMatcher() noexcept = default;
  /// `capacity`: maximum number of points in either image.
  SurfMatcher(std::size_t capacity, Arena& arena);

  /// Matches are in the order of the left points.
  [[nodiscard]] SurfMatchStatus match(const SurfView& left, const SurfView& right,
                                      BoundedVector<SurfMatch>* out) noexcept;

 private:
  struct Best {
    std::uint32_t partner = 0;
    // Squared distances of the best and the second best.
    float square = 0, second = 0;
    bool described = false;
  };
  void compare(const SurfView& left, const SurfView& right) noexcept;

  std::span<Best> left_, right_;
};

}  // namespace vergence::features
