#pragma once
#include "app/checkerboard/board_pattern.hpp"
#include "app/checkerboard/checkerboard.hpp"

namespace vergence::app {

/// The corners of the tags that an image shows, to about a tenth of a pixel; a part of the board is
/// enough. Empty: fewer than four tags (or all, of a smaller board), or tags that do not lie as on
/// a board of these rows and columns.
///
/// Tags by the AprilTag library, family 36h11 with a black border of one or, as Kalibr prints them,
/// two cells; corners by OpenCV's cornerSubPix within the gap between tags. Tag 0 may be at the
/// lower left (Kalibr) or at the upper left.
[[nodiscard]] BoardCorners find_aprilgrid(const ImageView& image, const BoardPattern& board,
                                          BoardSearch search);

}  // namespace vergence::app
