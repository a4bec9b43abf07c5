#pragma once
#include <optional>
#include <vector>

#include "app/checkerboard/board_pattern.hpp"
#include "core/math/types.hpp"
#include "core/types/image.hpp"

namespace vergence::app {

enum class BoardSearch : std::uint8_t {
  thorough,  // images from files
  quick,     // live: gives up soon where no board is
};

/// The corners of the board in an image to about a tenth of a pixel, row by row, in the order of
/// BoardPattern::corner(); pixel centres at integers. The corner from which the rows run to the
/// right and down is found by the squares' colours where they tell, else it is the detector's
/// choice: see same_way_up(). Nothing: not all of them are there.
///
/// OpenCV's findChessboardCorners and cornerSubPix with a window that fits the smallest square
/// seen: a wider one reaches over the next corner.
[[nodiscard]] std::optional<std::vector<Vec2>> find_checkerboard(const ImageView& image,
                                                                 const BoardPattern& board,
                                                                 BoardSearch search);

/// Turns a board that does not tell its ends so that its diagonal runs as it does in another camera
/// of the rig, which is mounted the same way up.
void same_way_up(const std::vector<Vec2>& reference, std::vector<Vec2>* corners);

}  // namespace vergence::app
