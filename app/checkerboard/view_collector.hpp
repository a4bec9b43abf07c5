#pragma once
#include <cstdint>
#include <vector>

#include "app/checkerboard/coverage.hpp"

namespace vergence::app {

enum class OfferResult : std::uint8_t {
  accepted,
  /// Camera 0, or every other camera, does not see the whole target.
  not_seen,
  /// The target has moved since the last set, or was not seen then; different exposures would
  /// deform it.
  moving,
  /// The view adds no coverage.
  nothing_new,
};

/// Selects from live images the views that a calibration needs. Not thread-safe. Allocates.
class ViewCollector {
 public:
  explicit ViewCollector(Coverage coverage, double image_width_px);

  /// Offers the corners of one set of images; sets must be consecutive.
  [[nodiscard]] OfferResult offer(const BoardView& seen);
  [[nodiscard]] const std::vector<BoardView>& views() const noexcept { return views_; }
  [[nodiscard]] const Coverage& coverage() const noexcept { return coverage_; }
  /// True if coverage is complete.
  [[nodiscard]] bool complete() const { return coverage_.needs().empty(); }

 private:
  [[nodiscard]] bool still(const BoardView& seen) const;
  [[nodiscard]] bool elsewhere(const BoardView& seen) const;

  Coverage coverage_;
  double still_px_, elsewhere_px_;
  BoardView last_{};
  std::vector<BoardView> views_{};
};

/// Mean motion of the corners between two sets relative to the image width: 1 px of 640.
inline constexpr double kStillOfWidth = 0.0015;
/// Mean distance of the corners to those of every accepted view, relative to the image width.
inline constexpr double kElsewhereOfWidth = 0.05;

}  // namespace vergence::app
