#pragma once
#include "app/checkerboard/board_pattern.hpp"
#include "core/types/image.hpp"

namespace vergence::app {

/// Inner corners of a ChArUco board next to a visible marker, to about 0.1 px; a part of the target
/// is enough. Empty for fewer than four markers, or markers that do not match the squares.
///
/// Markers by OpenCV's aruco module; corners from adjacent markers, then by cornerSubPix within the
/// gap between marker and square. Markers are numbered row by row from the top, in the white
/// squares. The upper left square may be black (as printed since OpenCV 4.7) or, with an even
/// number of rows, white (before); the image determines which.
[[nodiscard]] BoardCorners find_charuco(const ImageView& image, const BoardPattern& board);

}  // namespace vergence::app
