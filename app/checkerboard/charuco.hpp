#pragma once
#include "app/checkerboard/board_pattern.hpp"
#include "core/types/image.hpp"

namespace vergence::app {

/// The inner corners of a ChArUco board that an image shows next to a marker, to about a tenth of a
/// pixel; a part of the board is enough. Empty: fewer than four markers, or markers that do not lie
/// as on a board of these squares.
///
/// Markers by OpenCV's aruco module; corners from the markers beside them, then by its cornerSubPix
/// within the gap between marker and square. Markers are numbered row by row from the top, in the
/// white squares. The upper left square may be black (as OpenCV prints from 4.7 on) or, with an
/// even number of rows, white (as before): which of them it is shows in the image.
[[nodiscard]] BoardCorners find_charuco(const ImageView& image, const BoardPattern& board);

}  // namespace vergence::app
