#pragma once
#include <cstdint>

#include "app/checkerboard/board_pattern.hpp"
#include "core/types/image.hpp"

namespace vergence::app {

enum class BoardSearch : std::uint8_t {
  /// For images from files.
  thorough,
  /// For live images: gives up soon if there is no target.
  quick,
};

/// Corners of the checkerboard in an image to about 0.1 px, in the order of BoardPattern::corner().
/// The first corner follows from the squares' colours if these are unambiguous, else from
/// `reference`: the corners in another camera of the rig with the same orientation at the same
/// time. Empty unless all corners are visible.
///
/// Uses OpenCV's findChessboardCorners, and cornerSubPix with a window that fits the smallest
/// visible square; a wider one would reach over the next corner.
[[nodiscard]] BoardCorners find_checkerboard(const ImageView& image, const BoardPattern& board,
                                             BoardSearch search,
                                             const BoardCorners& reference = {});

}  // namespace vergence::app
