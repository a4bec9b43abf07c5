#pragma once
#include <optional>
#include <vector>

#include "app/checkerboard/board_pattern.hpp"
#include "core/math/types.hpp"
#include "core/types/image.hpp"

namespace vergence::app {

enum class BoardSearch : std::uint8_t {
  /// For images from files.
  thorough,
  /// For live images: gives up soon if there is no target.
  quick,
};

/// Corners of the checkerboard in an image to about 0.1 px, row by row in the order of
/// BoardPattern::corner(), with pixel centres at integers. The first corner follows from the
/// squares' colours if these are unambiguous, else it is the detector's choice: see same_way_up().
/// Empty unless all corners are visible.
///
/// Uses OpenCV's findChessboardCorners, and cornerSubPix with a window that fits the smallest
/// visible square; a wider one would reach over the next corner.
[[nodiscard]] std::optional<std::vector<Vec2>> find_checkerboard(const ImageView& image,
                                                                 const BoardPattern& board,
                                                                 BoardSearch search);

/// Rotates a symmetric target so that its diagonal has the direction seen in another camera of the
/// rig with the same orientation.
void same_way_up(const std::vector<Vec2>& reference, std::vector<Vec2>* corners);

}  // namespace vergence::app
