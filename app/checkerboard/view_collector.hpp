#pragma once
#include <cstdint>
#include <vector>

#include "app/checkerboard/coverage.hpp"

namespace vergence::app {

enum class OfferResult : std::uint8_t {
  taken,
  not_seen,     // camera 0, or every other camera, does not have the whole board
  moving,       // the board is not where it was a moment ago, or was not seen then: exposures that
                // differ would make it bend
  nothing_new,  // all of this has been seen
};

/// Picks from live images the views that a calibration needs.
///
/// Not thread-safe. Allocates.
class ViewCollector {
 public:
  explicit ViewCollector(Coverage coverage, double image_width_px);

  /// Corners of one set of images; sets come one after the other.
  [[nodiscard]] OfferResult offer(const BoardView& seen);
  [[nodiscard]] const std::vector<BoardView>& views() const noexcept { return views_; }
  [[nodiscard]] const Coverage& coverage() const noexcept { return coverage_; }
  /// Nothing is missing any more.
  [[nodiscard]] bool complete() const { return coverage_.needs().empty(); }

 private:
  [[nodiscard]] bool still(const BoardView& seen) const;
  [[nodiscard]] bool elsewhere(const BoardView& seen) const;

  Coverage coverage_;
  double still_px_, elsewhere_px_;
  BoardView last_{};
  std::vector<BoardView> views_{};
};

inline constexpr double kStillOfWidth =
    0.0015;  // mean motion of the corners between two sets: 1 px of 640
inline constexpr double kElsewhereOfWidth =
    0.05;  // mean distance of the corners to those of every view taken

}  // namespace vergence::app
