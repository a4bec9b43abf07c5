#pragma once
#include <span>
#include <string>
#include <vector>

#include "core/types/image.hpp"

/// What can be told of pictures without knowing what is on them. Pure functions.
namespace vergence::app {

struct PictureFigures {
  double mean = 0;       // grey levels
  double contrast = 0;   // standard deviation, grey levels
  double saturated = 0;  // share of pixels at 254 and above
  double dark = 0;       // share of pixels at 4 and below
  double sharpness = 0;  // mean squared gradient (central differences), (grey levels / px)²: falls
                         // with blur, rises with noise
};
/// Precondition: not empty. Images of one row or column have no sharpness.
[[nodiscard]] PictureFigures figures_of(const ImageView& image) noexcept;

/// One thing that strikes the eye.
struct PictureRemark {
  bool unusable = false;  // these pictures are no good; else they could be better
  std::string sentence;
};

/// Exposure of each picture, and sharpness of each against the sharpest.
[[nodiscard]] std::vector<PictureRemark> judge_pictures(std::span<const std::string> names,
                                                        std::span<const PictureFigures> figures);

/// Whether two pictures are the same pixel for pixel: one camera twice. Flat ones (a lens cap) are
/// not called that.
[[nodiscard]] bool are_identical(const ImageView& a, const ImageView& b) noexcept;

}  // namespace vergence::app
