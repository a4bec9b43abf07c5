#pragma once
#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "app/checkerboard/board_calibration.hpp"
#include "app/datasets/image_file.hpp"

namespace vergence::app {

/// Coverage of the views so far: missing parts of each image, tilts, sizes and number.
///
/// Parts    Nine of each image, the outer ones a third wide: distortion is determined where the
///          corners are, and nowhere else.
/// Tilts    Four, kTilt and more: without them focal length and distance cannot be told apart. Of
///          camera 0, as it sees the board.
/// Sizes    Once as near as both cameras let it come, once clearly farther.
class Coverage {
 public:
  /// `names` and `sizes` one a camera; `focal_px` of camera 0, roughly: it only serves the tilts.
  Coverage(const BoardPattern& board, std::vector<std::string> names, std::vector<ImageSize> sizes,
           double focal_px);

  void add(const BoardView& view);
  /// Returns true if a view adds a missing part, tilt or size.
  [[nodiscard]] bool brings_something(const BoardView& view) const;
  /// Describes missing coverage, the most useful first: "left: top right and bottom", "the board's
  /// left edge nearer", "5 more views".
  [[nodiscard]] std::vector<std::string> needs() const;
  [[nodiscard]] std::size_t views() const noexcept { return views_; }

 private:
  static constexpr std::size_t kParts = 9, kTilts = 4;
  struct Seen {
    std::array<int, kParts> parts{};  // of the view that has most there
  };
  /// Pose of the target in front of camera 0.
  struct Stand {
    double extent = 0;  // of the image's width or height, whichever it fills more of
    std::array<bool, kTilts> tilted{};  // right, left, bottom, top edge nearer
  };
  [[nodiscard]] Stand stand_of(const BoardView& view) const;
  void count(const BoardView& view, std::size_t camera, Seen* seen) const;

  BoardPattern board_;
  std::vector<std::string> names_;
  std::vector<ImageSize> sizes_;
  double focal_px_;
  std::vector<Seen> seen_;
  std::array<bool, kTilts> tilted_{};
  double nearest_ = 0, farthest_ = 1;  // extents
  std::size_t views_ = 0;
};

inline constexpr std::size_t kEnoughViews = 12;
inline constexpr int kEnoughCorners = 6;     // of one view in a part
inline constexpr double kTilt = 0.26;        // rad, 15°
inline constexpr double kNearExtent = 0.35;  // of the image
inline constexpr double kFarOfNear = 0.75;   // extents, far over near

}  // namespace vergence::app
