#include "app/checkerboard/board_detector.hpp"

#include <algorithm>
#include <map>

#include <opencv2/core.hpp>

namespace vergence::app {
bool determine_a_homography(const BoardCorners& corners, const BoardPattern& board) {
  constexpr std::size_t kMinCorners = 6;
  if (corners.size() < std::min(kMinCorners, board.corners())) return false;
  std::map<double, int> in_row;
  for (const BoardCorner& c : corners) ++in_row[board.corner(c.index).y()];
  return std::ranges::count_if(in_row, [](const auto& row) { return row.second >= 2; }) >= 2;
}

BoardCorners find_board(const ImageView& image, const BoardPattern& board, BoardSearch search,
                        const BoardCorners& reference) try {
  const BoardCorners corners =
      board.kind == BoardKind::aprilgrid ? find_aprilgrid(image, board, search)
      : board.kind == BoardKind::charuco ? find_charuco(image, board)
                                         : find_checkerboard(image, board, search, reference);
  return determine_a_homography(corners, board) ? corners : BoardCorners();
} catch (const cv::Exception&) {
  // An image on which the detector throws contains no calibration target.
  return {};
}

}  // namespace vergence::app
