#include "app/calibration/charuco.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include <opencv2/aruco.hpp>

#include "app/runtime/errors.hpp"
#include "tests/unit/app/calibration/board_painter.hpp"
#include "tests/unit/app/calibration/board_scene.hpp"

namespace vergence::app {
namespace {

using test::known_rig;

constexpr int kWidth = 640, kHeight = 480;

/// A ChArUco board as it is printed.
class CharucoPainter {
 public:
  /// `black_first`: the upper left square is black.
  CharucoPainter(const BoardPattern& board, bool black_first) : board_(board) {
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
    return test::paint_board(lens, T, [this](double x, double y) { return grey(x, y); });
  }

 private:
  static constexpr int kSquare = 120;  // px of the picture

  [[nodiscard]] double grey(double x, double y) const {
    const double u = (x / board_.square + 1) * kSquare, v = (y / board_.square + 1) * kSquare;
    constexpr double kMargin = 0.3 * kSquare;
    if (u < -kMargin || v < -kMargin || u >= picture_.cols + kMargin ||
        v >= picture_.rows + kMargin)
      return test::kPaintedGrey;
    if (u < 0 || v < 0 || u >= picture_.cols || v >= picture_.rows) return test::kPaintedWhite;
    return picture_.at<std::uint8_t>(static_cast<int>(v), static_cast<int>(u)) > 127
               ? test::kPaintedWhite
               : test::kPaintedBlack;
  }

  BoardPattern board_;
  cv::Mat picture_;
};

Transform shown(const BoardPattern& board, const Vec3& turn, const Vec3& centre) {
  const Mat3 R = exp_so3(turn);
  return {R, centre - R * (0.5 * (board.corner(0) + board.corner(board.corners() - 1)))};
}

BoardCorners found_in(const std::vector<std::uint8_t>& pixels, const BoardPattern& board) {
  return find_charuco({pixels.data(), kWidth, kHeight, kWidth}, board);
}

// cornerSubPix's error in drawn images, as for AprilGrids; a wrong index would be a square, 30 px.
void expect_corners(const BoardCorners& found, const RigCalibration& rig, const BoardPattern& board,
                    const Transform& T) {
  Vec2 sum = Vec2::Zero();
  for (const BoardCorner& c : found) {
    Vec2 truth;
    ASSERT_EQ(Camera(rig.intrinsics[0]).project(T * board.corner(c.index), &truth, nullptr),
              ProjectStatus::ok);
    EXPECT_LT((c.pixel - truth).norm(), 0.3) << c.index << ": " << (c.pixel - truth).transpose();
    sum += c.pixel - truth;
  }
  EXPECT_LT(sum.norm(), 0.05 * static_cast<double>(found.size()));
}

TEST(Charuco, cornersAreFoundWhicheverWayItIsPrinted) {
  const RigCalibration rig = known_rig(1, CameraModelKind::pinhole_radtan);
  const BoardPattern odd = parse_charuco("8x7", 0.06, 0.044, "DICT_5X5_100"),
                     even = parse_charuco("9x6", 0.06, 0.044, "6x6_250");
  for (const auto& [board, black_first] :
       {std::pair(odd, true), std::pair(even, true), std::pair(even, false)}) {
    const Transform T = shown(board, Vec3(0.3, -0.2, 0.1), Vec3(0.02, -0.01, 0.75));
    const BoardCorners found =
        found_in(CharucoPainter(board, black_first).paint(rig.intrinsics[0], T), board);
    EXPECT_GT(found.size(), board.corners() * 9 / 10) << board.words() << black_first;
    expect_corners(found, rig, board, T);
  }
}

TEST(Charuco, aPartOfTheBoardIsEnough) {
  const RigCalibration rig = known_rig(1, CameraModelKind::pinhole_radtan);
  const BoardPattern board = parse_charuco("8x7", 0.06, 0.044, "5X5_100");
  const CharucoPainter painter(board, true);
  for (const auto& [turn, centre] : {std::pair(Vec3(0.2, 0.2, 0), Vec3(-0.3, -0.22, 0.65)),
                                     std::pair(Vec3(0.1, -0.2, M_PI), Vec3(0.3, -0.2, 0.65))}) {
    const Transform T = shown(board, turn, centre);
    const BoardCorners found = found_in(painter.paint(rig.intrinsics[0], T), board);
    EXPECT_GE(found.size(), 8U);
    EXPECT_LT(found.size(), board.corners()) << "the board is not cut off: nothing is tested";
    expect_corners(found, rig, board, T);
  }
}

TEST(Charuco, anotherBoardOrNoneIsNothing) {
  const RigCalibration rig = known_rig(1, CameraModelKind::pinhole_radtan);
  const BoardPattern board = parse_charuco("8x7", 0.06, 0.044, "5X5_100");
  EXPECT_TRUE(found_in(std::vector<std::uint8_t>(kWidth * kHeight, 128), board).empty());
  EXPECT_TRUE(find_charuco({}, board).empty());
  const auto pixels =
      CharucoPainter(board, true)
          .paint(rig.intrinsics[0], shown(board, Vec3(0.1, 0.1, 0), Vec3(0, 0, 0.75)));
  EXPECT_FALSE(found_in(pixels, board).empty());
  EXPECT_TRUE(found_in(pixels, parse_charuco("6x9", 0.06, 0.044, "5X5_100")).empty())
      << "markers that lie as on a board of other columns";
  EXPECT_TRUE(found_in(pixels, parse_charuco("8x7", 0.06, 0.044, "4X4_50")).empty())
      << "markers of another dictionary";
}

TEST(Charuco, onlyBoardsThatCanBePrintedArePermitted) {
  const BoardPattern board = parse_charuco("11x8", 0.03, 0.022, "dict_4x4_250");
  EXPECT_EQ(board.corners(), 70U);
  EXPECT_EQ(kMarkerDictionaries[board.dictionary], "4X4_250");
  EXPECT_EQ(board.words(), "11x8 squares with markers 4X4_250");
  for (const char* bad : {"", "11", "11x", "2x8", "101x8"})
    EXPECT_THROW((void)parse_charuco(bad, 0.03, 0.022, "4X4_250"), InputError) << bad;
  for (const double bad : {0.0, -0.02, 0.03, std::nan("")})
    EXPECT_THROW((void)parse_charuco("11x8", 0.03, bad, "4X4_250"), InputError) << bad;
  for (const char* bad : {"", "4X4", "DICT_", "8X8_50"})
    EXPECT_THROW((void)parse_charuco("11x8", 0.03, 0.022, bad), InputError) << bad;
}

}  // namespace
}  // namespace vergence::app
