#pragma once
#include <cmath>
#include <cstdint>
#include <vector>

#include <opencv2/aruco.hpp>

#include "app/calibration/board_pattern.hpp"
#include "core/math/so3.hpp"
#include "tests/unit/app/calibration/board_painter.hpp"

namespace vergence::test {

/// A ChArUco board as it is printed.
class CharucoPainter {
 public:
  /// `black_first`: the upper left square is black.
  CharucoPainter(const app::BoardPattern& board, bool black_first) : board_(board) {
    const auto dictionary = cv::aruco::getPredefinedDictionary(static_cast<int>(board.dictionary));
    const int columns = board.columns + 1, rows = board.rows + 1;
    picture_.create(rows * kSquare, columns * kSquare, CV_8U);
    const int side = static_cast<int>(std::lround(kSquare * board.marker / board.square));
    const int gap = (kSquare - side) / 2;
    int id = 0;
    for (int row = 0; row < rows; ++row)
      for (int column = 0; column < columns; ++column) {
        cv::Mat square = picture_(cv::Rect(column * kSquare, row * kSquare, kSquare, kSquare));
        const bool black = ((row + column) % 2 == 0) == black_first;
        square.setTo(black ? 0 : 255);
        if (black) continue;
        cv::Mat marker;
        dictionary->drawMarker(id++, side, marker, 1);
        marker.copyTo(square(cv::Rect(gap, gap, side, side)));
      }
  }

  [[nodiscard]] std::vector<std::uint8_t> paint(const Intrinsics& lens, const Transform& T) const {
    return paint_board(lens, T, [this](double x, double y) { return grey(x, y); });
  }

 private:
  static constexpr int kSquare = 120;  // px of the picture

  [[nodiscard]] double grey(double x, double y) const {
    const double u = (x / board_.square + 1) * kSquare, v = (y / board_.square + 1) * kSquare;
    constexpr double kMargin = 0.3 * kSquare;
    if (u < -kMargin || v < -kMargin || u >= picture_.cols + kMargin ||
        v >= picture_.rows + kMargin)
      return kPaintedGrey;
    if (u < 0 || v < 0 || u >= picture_.cols || v >= picture_.rows) return kPaintedWhite;
    return picture_.at<std::uint8_t>(static_cast<int>(v), static_cast<int>(u)) > 127
               ? kPaintedWhite
               : kPaintedBlack;
  }

  app::BoardPattern board_;
  cv::Mat picture_;
};

/// Its middle at `centre`, turned about it.
inline Transform shown_charuco(const app::BoardPattern& board, const Vec3& turn,
                               const Vec3& centre) {
  const Mat3 R = exp_so3(turn);
  return {R, centre - R * (0.5 * (board.corner(0) + board.corner(board.corners() - 1)))};
}

}  // namespace vergence::test
