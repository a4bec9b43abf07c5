#include "app/calibration/board_detector.hpp"

#include "app/calibration/aprilgrid.hpp"
#include "app/calibration/charuco.hpp"

namespace vergence::app {
namespace {

std::vector<Vec2> pixels_of(const BoardCorners& corners) {
  std::vector<Vec2> pixels;
  pixels.reserve(corners.size());
  for (const BoardCorner& c : corners) pixels.push_back(c.pixel);
  return pixels;
}

}  // namespace

BoardCorners find_board(const ImageView& image, const BoardPattern& board, BoardSearch search,
                        const BoardCorners& reference) {
  if (board.kind == BoardKind::aprilgrid) return find_aprilgrid(image, board, search);
  if (board.kind == BoardKind::charuco) return find_charuco(image, board);
  auto found = find_checkerboard(image, board, search);
  if (!found) return {};
  if (!board.tells_its_ends()) same_way_up(pixels_of(reference), &*found);
  BoardCorners corners;
  for (std::size_t i = 0; i < found->size(); ++i) corners.push_back({i, (*found)[i]});
  return corners;
}

}  // namespace vergence::app
