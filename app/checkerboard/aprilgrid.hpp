#pragma once
#include "app/checkerboard/board_pattern.hpp"
#include "app/checkerboard/checkerboard.hpp"

namespace vergence::app {

/// Corners of the visible tags to about 0.1 px; a part of the target is enough. Empty for fewer
/// than four tags (or not all, of a smaller target), or tags that do not match the rows and
/// columns.
///
/// Tags by the AprilTag library, family 36h11 with a black border of one or, as Kalibr prints them,
/// two cells; corners by OpenCV's cornerSubPix within the gap between tags. Tag 0 may be at the
/// lower left (Kalibr) or at the upper left.
[[nodiscard]] BoardCorners find_aprilgrid(const ImageView& image, const BoardPattern& board,
                                          BoardSearch search);

}  // namespace vergence::app
