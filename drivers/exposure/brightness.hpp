#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/types/image.hpp"

namespace vergence::exposure {

/// Brightness of an image in grey levels, 0 … 255.
struct Brightness {
  double mean = 0;
  double bright = 0;     // below it lie all pixels but the share that may be saturated
  double saturated = 0;  // share of pixels at the top of the scale
  int samples = 0;       // 0: nothing was looked at
};

inline constexpr int kSaturated =
    250;  // grey level from which a pixel tells nothing but that it is bright

/// Measures images on a sparse grid, leaving out what a mask hides.
///
/// Threads  measure(): any. Memory: places at construction, none afterwards. Time: kColumns · kRows
///          pixels read, some 10 µs.
class BrightnessMeter {
 public:
  static constexpr int kColumns = 48, kRows = 36;

  /// Measures images of this size. `mask`: 0 hides; empty, or of another size: nothing is hidden.
  BrightnessMeter(int width, int height, const ImageView& mask);

  /// `may_saturate`: share of the pixels, 0 … 1. Of an image of another size: no samples.
  [[nodiscard]] Brightness measure(const ImageView& image, double may_saturate) const noexcept;
  [[nodiscard]] std::size_t places() const noexcept { return places_.size(); }

 private:
  struct Place {
    std::int16_t x = 0, y = 0;  // px
  };
  int width_, height_;
  std::vector<Place> places_;
};

}  // namespace vergence::exposure
