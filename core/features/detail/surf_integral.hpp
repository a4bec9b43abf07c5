#pragma once
#include <cstdint>
#include <span>

#include "core/memory/arena.hpp"
#include "core/types/image.hpp"

namespace vergence::features::detail {

/// Integral image for sums over rectangles (Viola & Jones 2001): S(x, y) = Σ of the pixels in
/// columns below x and rows below y.
///
/// Sums are modulo 2³²; the sum of a box of fewer than 2³¹/255 pixels is exact.
/// Memory  (width + 1) · (height + 1) numbers in the arena, for the largest image.
class IntegralImage {
 public:
  IntegralImage() noexcept = default;
  IntegralImage(int max_width, int max_height, Arena& arena);

  /// Precondition: the image is not larger than given to the constructor.
  void build(const ImageView& image) noexcept;
  void clear() noexcept { width_ = height_ = 0; }

  [[nodiscard]] int width() const noexcept { return width_; }
  [[nodiscard]] int height() const noexcept { return height_; }
  /// S(0 … width, y), 0 ≤ y ≤ height.
  [[nodiscard]] const std::uint32_t* row(int y) const noexcept {
    return sums_.data() + static_cast<std::size_t>(y) * static_cast<std::size_t>(width_ + 1);
  }

 private:
  std::span<std::uint32_t> sums_;
  int width_ = 0, height_ = 0;
};

}  // namespace vergence::features::detail
