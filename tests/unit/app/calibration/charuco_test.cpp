#include "app/calibration/charuco.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include <opencv2/aruco.hpp>

#include "app/runtime/errors.hpp"
#include "tests/unit/app/calibration/board_painter.hpp"
#include "tests/unit/app/calibration/board_scene.hpp"

namespace vergence::app {
namespace {

using test::expect_corners;
using test::known_rig;

constexpr int kWidth = 640, kHeight = 480;

BoardCorners found_in(const std::vector<std::uint8_t>& pixels, const BoardPattern& board) {
  return find_charuco({pixels.data(), kWidth, kHeight, kWidth}, board);
}

/// `black_first`: the upper left square is black.
test::PrintedBoard printed_charuco(const BoardPattern& board, bool black_first) {
  constexpr int kSquare = 120, kMargin = 36;  // px
  const auto dictionary = cv::aruco::getPredefinedDictionary(static_cast<int>(board.dictionary));
  const int columns = board.columns + 1, rows = board.rows + 1;
  cv::Mat picture(rows * kSquare + 2 * kMargin, columns * kSquare + 2 * kMargin, CV_8U,
                  cv::Scalar(255));
  const int side = static_cast<int>(std::lround(kSquare * board.marker / board.square));
  const int gap = (kSquare - side) / 2;
  int id = 0;
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) {
      cv::Mat square =
          picture(cv::Rect(kMargin + column * kSquare, kMargin + row * kSquare, kSquare, kSquare));
      cv::Mat marker;
      if (((row + column) % 2 == 0) == black_first) {
        square.setTo(0);
      } else {
        dictionary->drawMarker(id++, side, marker, 1);
        marker.copyTo(square(cv::Rect(gap, gap, side, side)));
      }
    }
  return {picture, kSquare / board.square, kMargin + kSquare, kMargin + kSquare};
}

/// Its middle at `centre`, turned about it.
Transform shown_charuco(const BoardPattern& board, const Vec3& turn, const Vec3& centre) {
  const Mat3 R = exp_so3(turn);
  return {R, centre - R * (0.5 * (board.corner(0) + board.corner(board.corners() - 1)))};
}

TEST(Charuco, cornersAreFoundWhicheverWayItIsPrinted) {
  const RigCalibration rig = known_rig(1, CameraModelKind::pinhole_radtan);
  const BoardPattern odd = parse_charuco("8x7", 0.06, 0.044, "DICT_5X5_100"),
                     even = parse_charuco("9x6", 0.06, 0.044, "6x6_250");
  for (const auto& [board, black_first] :
       {std::pair(odd, true), std::pair(even, true), std::pair(even, false)}) {
    const Transform T = shown_charuco(board, Vec3(0.3, -0.2, 0.1), Vec3(0.02, -0.01, 0.75));
    const BoardCorners found =
        found_in(printed_charuco(board, black_first).paint(rig.intrinsics[0], T), board);
    EXPECT_GT(found.size(), board.corners() * 9 / 10) << board.words() << black_first;
    expect_corners(found, rig, board, T);
  }
}

TEST(Charuco, aPartOfTheBoardIsEnough) {
  const RigCalibration rig = known_rig(1, CameraModelKind::pinhole_radtan);
  const BoardPattern board = parse_charuco("8x7", 0.06, 0.044, "5X5_100");
  const test::PrintedBoard painter = printed_charuco(board, true);
  for (const auto& [turn, centre] : {std::pair(Vec3(0.2, 0.2, 0), Vec3(-0.3, -0.22, 0.65)),
                                     std::pair(Vec3(0.1, -0.2, M_PI), Vec3(0.3, -0.2, 0.65))}) {
    const Transform T = shown_charuco(board, turn, centre);
    const BoardCorners found = found_in(painter.paint(rig.intrinsics[0], T), board);
    EXPECT_GE(found.size(), 8U);
    EXPECT_LT(found.size(), board.corners()) << "the board is not cut off: nothing is tested";
    expect_corners(found, rig, board, T);
  }
}

TEST(Charuco, aMarkerThatTheBoardDoesNotHaveIsPassedOver) {
  const RigCalibration rig = known_rig(1, CameraModelKind::pinhole_radtan);
  const BoardPattern board = parse_charuco("8x7", 0.06, 0.044, "5X5_100");
  const Transform T = shown_charuco(board, Vec3(0.3, -0.2, 0.1), Vec3(0.02, -0.01, 0.85));
  auto pixels = printed_charuco(board, true).paint(rig.intrinsics[0], T);
  const BoardCorners alone = found_in(pixels, board);
  ASSERT_FALSE(alone.empty());
  constexpr int kSide = 42, kMargin = 8;
  cv::Mat label(kSide + 2 * kMargin, kSide + 2 * kMargin, CV_8U, cv::Scalar(255)), marker;
  cv::aruco::getPredefinedDictionary(static_cast<int>(board.dictionary))
      ->drawMarker(99, kSide, marker, 1);
  marker.copyTo(label(cv::Rect(kMargin, kMargin, kSide, kSide)));
  cv::Mat image(kHeight, kWidth, CV_8U, pixels.data());
  label.copyTo(image(cv::Rect(0, kHeight - label.rows, label.cols, label.rows)));
  std::vector<std::vector<cv::Point2f>> corners;
  std::vector<int> ids;
  cv::aruco::detectMarkers(
      image, cv::aruco::getPredefinedDictionary(static_cast<int>(board.dictionary)), corners, ids);
  ASSERT_EQ(std::count(ids.begin(), ids.end(), 99), 1) << "it is not seen: nothing is tested";
  EXPECT_EQ(found_in(pixels, board).size(), alone.size());
}

TEST(Charuco, anotherBoardOrNoneIsNothing) {
  const RigCalibration rig = known_rig(1, CameraModelKind::pinhole_radtan);
  const BoardPattern board = parse_charuco("8x7", 0.06, 0.044, "5X5_100");
  EXPECT_TRUE(found_in(std::vector<std::uint8_t>(kWidth * kHeight, 128), board).empty());
  EXPECT_TRUE(find_charuco({}, board).empty());
  const auto pixels =
      printed_charuco(board, true)
          .paint(rig.intrinsics[0], shown_charuco(board, Vec3(0.1, 0.1, 0), Vec3(0, 0, 0.75)));
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
