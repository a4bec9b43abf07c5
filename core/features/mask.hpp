#pragma once
#include <cstdint>
#include <span>

#include "core/math/types.hpp"
#include "core/memory/arena.hpp"
#include "core/types/image.hpp"

namespace vergence::features {

/// Pixels without features: the vehicle itself, dirt on the glass. One bit per pixel.
///
/// Ownership  The source image is read in the constructor only.
/// Threads    Any number of readers.
/// Memory     From the arena at construction: an eighth of the image.
class Mask {
 public:
  /// Hides nothing.
  Mask() noexcept = default;
  /// Hides the pixels of `image` that are 0 and those within `margin` px of one along x and y. An
  /// empty image hides nothing.
  Mask(const ImageView& image, int margin, Arena& arena);

  /// Pixels outside the image are not hidden; callers check the edge.
  [[nodiscard]] bool hides(int x, int y) const noexcept {
    if (bits_.empty() || x < 0 || y < 0 || x >= width_ || y >= height_) return false;
    return (bits_[word(x, y)] >> (static_cast<unsigned>(x) % 64U) & 1U) != 0;
  }
  [[nodiscard]] bool hides(const Vec2& pixel) const noexcept;
  [[nodiscard]] bool empty() const noexcept { return bits_.empty(); }

 private:
  [[nodiscard]] std::size_t word(int x, int y) const noexcept {
    return static_cast<std::size_t>(y) * words_per_row_ + static_cast<std::size_t>(x) / 64U;
  }
  /// Hides [first, last) of a row.
  void hide(int first, int last, int y) noexcept;

  int width_ = 0, height_ = 0;
  std::size_t words_per_row_ = 0;
  std::span<std::uint64_t> bits_;
};

}  // namespace vergence::features
