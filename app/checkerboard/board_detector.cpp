#include "app/checkerboard/board_detector.hpp"

#include <algorithm>
#include <map>

#include <opencv2/core.hpp>

#include "app/checkerboard/aprilgrid.hpp"
#include "app/checkerboard/charuco.hpp"

namespace vergence::app {
namespace {

constexpr std::size_t kMinCorners = 6;

std::vector<Vec2> to_pixels(const BoardCorners& corners) {
  std::vector<Vec2> pixels;
  pixels.reserve(corners.size());
  for (const BoardCorner& c : corners) pixels.push_back(c.pixel);
  return pixels;
}

BoardCorners find_any_board(const ImageView& image, const BoardPattern& board, BoardSearch search,
                            const BoardCorners& reference) {
  if (board.kind == BoardKind::aprilgrid) return find_aprilgrid(image, board, search);
  if (board.kind == BoardKind::charuco) return find_charuco(image, board);
  auto found = find_checkerboard(image, board, search);
  if (!found) return {};
  if (!board.is_asymmetric()) same_way_up(to_pixels(reference), &*found);
  BoardCorners corners;
  for (std::size_t i = 0; i < found->size(); ++i) corners.push_back({i, (*found)[i]});
  return corners;
}

}  // namespace

bool determine_a_homography(const BoardCorners& corners, const BoardPattern& board) {
  if (corners.size() < std::min(kMinCorners, board.corners())) return false;
  std::map<double, int> in_row;
  for (const BoardCorner& c : corners) ++in_row[board.corner(c.index).y()];
  return std::ranges::count_if(in_row, [](const auto& row) { return row.second >= 2; }) >= 2;
}

BoardCorners find_board(const ImageView& image, const BoardPattern& board, BoardSearch search,
                        const BoardCorners& reference) {
  try {
    BoardCorners corners = find_any_board(image, board, search, reference);
    return determine_a_homography(corners, board) ? corners : BoardCorners();
  } catch (const cv::Exception&) {
    // An image on which the detector throws contains no calibration target.
    return {};
  }
}

}  // namespace vergence::app
