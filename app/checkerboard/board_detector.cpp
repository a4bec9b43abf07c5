#include "app/checkerboard/board_detector.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Eigenvalues>
#include <opencv2/core.hpp>

#include "app/checkerboard/aprilgrid.hpp"
#include "app/checkerboard/charuco.hpp"

namespace vergence::app {
namespace {

constexpr std::size_t kMinCorners = 6;
constexpr double kThinnest = 0.5;  // squares

/// Where corners lie on the board, in squares.
struct Places {
  double n = 0;
  Vec2 sum = Vec2::Zero();
  Mat2 squares = Mat2::Zero();

  void count(const Vec2& at, double times) {
    n += times;
    sum += times * at;
    squares += times * at * at.transpose();
  }
  /// Least singular value about their mean: by how much they are off the line that fits best.
  [[nodiscard]] double thickness() const {
    const Mat2 centred = squares - sum * sum.transpose() / n;
    return std::sqrt(std::max(0.0, Eigen::SelfAdjointEigenSolver<Mat2>(centred).eigenvalues()(0)));
  }
};

std::vector<Vec2> pixels_of(const BoardCorners& corners) {
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
  if (!board.is_asymmetric()) same_way_up(pixels_of(reference), &*found);
  BoardCorners corners;
  for (std::size_t i = 0; i < found->size(); ++i) corners.push_back({i, (*found)[i]});
  return corners;
}

}  // namespace

bool determine_a_homography(const BoardCorners& corners, const BoardPattern& board) {
  if (corners.size() < std::min(kMinCorners, board.corners())) return false;
  const auto place = [&](const BoardCorner& c) -> Vec2 {
    return board.corner(c.index).head<2>() / board.square;
  };
  Places all;
  for (const BoardCorner& c : corners) all.count(place(c), 1);
  return std::all_of(corners.begin(), corners.end(), [&](const BoardCorner& c) {
    Places others = all;
    others.count(place(c), -1);
    return others.thickness() > kThinnest;
  });
}

BoardCorners find_board(const ImageView& image, const BoardPattern& board, BoardSearch search,
                        const BoardCorners& reference) {
  try {
    BoardCorners corners = find_any_board(image, board, search, reference);
    return determine_a_homography(corners, board) ? corners : BoardCorners();
  } catch (const cv::Exception&) {
    return {};  // what the detector stumbles over is no board
  }
}

}  // namespace vergence::app
