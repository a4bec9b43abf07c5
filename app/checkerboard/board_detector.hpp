#pragma once
#include "app/checkerboard/board_pattern.hpp"
#include "app/checkerboard/checkerboard.hpp"

namespace vergence::app {

/// True with at least six corners (of a board of fewer: all), of which two rows have two: no three
/// of those four lie on a line. Without a homography OpenCV throws, at that view and at all views
/// together.
[[nodiscard]] bool determine_a_homography(const BoardCorners& corners, const BoardPattern& board);

/// Detects the target in an image: of a checkerboard all corners or none, of an AprilGrid or a
/// ChArUco board those that are there, if they determine a homography.
///
/// `reference`: what another camera of the rig, mounted the same way up, shows of it at the same
/// time; it decides where the board does not tell its ends. May be empty.
[[nodiscard]] BoardCorners find_board(const ImageView& image, const BoardPattern& board,
                                      BoardSearch search, const BoardCorners& reference);

}  // namespace vergence::app
