#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/types/image.hpp"

namespace vergence::exposure {

/// Brightness of an image in grey levels, 0 to 255.
struct Brightness {
  double mean = 0;
  /// Level below which all pixels lie, except the share that may saturate.
  double bright = 0;
  /// Share of saturated pixels.
  double saturated = 0;
  /// Number of evaluated pixels.
  int samples = 0;
};

/// Grey level from which a pixel counts as saturated.
inline constexpr int kSaturated = 250;

/// Measures images on a sparse grid without masked pixels. measure() is thread-safe, does not
/// allocate, and reads kColumns · kRows pixels in some 10 µs.
class BrightnessMeter {
 public:
  static constexpr int kColumns = 48, kRows = 36;

  /// Measures images of this size. `mask` hides pixels of value 0; an empty one, or one of another
  /// size, hides none.
  BrightnessMeter(int width, int height, const ImageView& mask);

  /// `may_saturate` is a share of the pixels, 0 to 1. An image of another size has no samples.
  [[nodiscard]] Brightness measure(const ImageView& image, double may_saturate) const noexcept;
  [[nodiscard]] std::size_t places() const noexcept { return places_.size(); }

 private:
  struct Place {
    // Pixel coordinates.
    std::int16_t x = 0, y = 0;
  };
  int width_, height_;
  std::vector<Place> places_;
};

}  // namespace vergence::exposure
