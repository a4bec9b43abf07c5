#pragma once
#include "app/checkerboard/board_pattern.hpp"
#include "app/checkerboard/checkerboard.hpp"

namespace vergence::app {

/// True with at least six corners (or all of a smaller target) and two rows with two corners each:
/// no three of those four are collinear. Without a homography OpenCV throws for that view and for
/// all views together.
[[nodiscard]] bool determine_a_homography(const BoardCorners& corners, const BoardPattern& board);

/// Detects the target in an image: of a checkerboard all corners or none, of an AprilGrid or a
/// ChArUco board the visible ones if they determine a homography. `reference` has the corners in
/// another camera of the rig with the same orientation at the same time; it resolves a symmetric
/// target. May be empty.
[[nodiscard]] BoardCorners find_board(const ImageView& image, const BoardPattern& board,
                                      BoardSearch search, const BoardCorners& reference);

}  // namespace vergence::app
