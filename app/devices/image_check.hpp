#pragma once
#include <span>
#include <string>
#include <vector>

#include "core/types/image.hpp"

namespace vergence::app {

struct ImageStatistics {
  /// Mean grey level.
  double mean = 0;
  /// Standard deviation of the grey levels.
  double contrast = 0;
  /// Share of pixels at 254 and above.
  double saturated = 0;
  /// Share of pixels at 4 and below.
  double dark = 0;
  /// Mean squared gradient (central differences), in (grey levels / px)²; it decreases with blur
  /// and increases with noise.
  double sharpness = 0;
};
/// Precondition: not empty. Images of one row or column have no sharpness.
[[nodiscard]] ImageStatistics image_statistics(const ImageView& image) noexcept;

/// Visible defect of an image.
struct ImageIssue {
  /// True if the images are unusable, false if they could be better.
  bool unusable = false;
  std::string message;
};

/// Evaluates the exposure of each image, and its sharpness relative to the sharpest.
[[nodiscard]] std::vector<ImageIssue> evaluate_images(std::span<const std::string> names,
                                                      std::span<const ImageStatistics> statistics);

/// True if all pixels of two images are equal, as from one camera that was opened twice. Flat
/// images (a lens cap) do not count.
[[nodiscard]] bool are_identical(const ImageView& a, const ImageView& b) noexcept;

}  // namespace vergence::app
