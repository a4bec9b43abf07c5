#pragma once
#include <array>

#include "core/memory/arena.hpp"
#include "core/types/image.hpp"

namespace vergence::features {

inline constexpr int kMaxPyramidLevels = 6;

/// Image pyramid. Pixel i of level l is pixel i·2^l of level 0, without a half-pixel shift.
///
/// Each level is the previous one, filtered by [1 4 6 4 1]/16 in both directions (border mirrored
/// without repeating the edge pixel), subsampled by two and rounded to 8 bits. Integer arithmetic:
/// the same bits on every machine.
///
/// Ownership  Level 0 is the caller's image, not copied: it must live until the next build(). The
///            others are in the arena.
/// Threads    build() by one thread; levels may be read by many afterwards.
class Pyramid {
 public:
  Pyramid() noexcept = default;
  /// Precondition: 1 ≤ levels ≤ kMaxPyramidLevels. There are fewer if a level would be smaller than
  /// 32 px on a side.
  Pyramid(int width, int height, int levels, Arena& arena);

  /// Precondition: the image has the size given to the constructor.
  void build(const ImageView& image) noexcept;

  [[nodiscard]] int levels() const noexcept { return levels_; }
  [[nodiscard]] const ImageView& level(int l) const noexcept {
    return views_[static_cast<std::size_t>(l)];
  }

 private:
  int levels_ = 0;
  std::array<ImageView, kMaxPyramidLevels> views_{};
  std::array<std::uint8_t*, kMaxPyramidLevels> storage_{};
  // One vertically filtered row, with margins.
  std::uint16_t* row_ = nullptr;
};

}  // namespace vergence::features
