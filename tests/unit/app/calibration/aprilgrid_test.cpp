#include <gtest/gtest.h>

#include <cmath>

#include <opencv2/aruco.hpp>

#include "app/calibration/aprilgrid.hpp"
#include "app/runtime/errors.hpp"
#include "tests/unit/app/calibration/board_painter.hpp"
#include "tests/unit/app/calibration/board_scene.hpp"

namespace vergence::app {
namespace {

using test::expect_corners;
using test::known_rig;

/// `border`: black cells around a tag's code; `from_below`: tag 0 at the lower left.
test::PrintedBoard printed(const BoardPattern& board, int border, bool from_below) {
  constexpr int kSide = 80;  // px of a tag
  const auto family = cv::aruco::getPredefinedDictionary(cv::aruco::DICT_APRILTAG_36h11);
  const int gap = static_cast<int>(std::lround(kSide * board.spacing)), pitch = kSide + gap,
            margin = 2 * gap;
  cv::Mat picture(board.rows * pitch - gap + 2 * margin, board.columns * pitch - gap + 2 * margin,
                  CV_8U, cv::Scalar(255));
  // A small square where the corners of four tags meet, and as much of it at the rim.
  for (int row = 0; row <= board.rows; ++row)
    for (int column = 0; column <= board.columns; ++column) {
      const int right = margin + column * pitch, below = margin + row * pitch;
      picture(cv::Rect(right - gap, below - gap, gap, gap)).setTo(0);
      if (row == board.rows || column == board.columns) continue;
      cv::Mat tag;
      family->drawMarker((from_below ? board.rows - 1 - row : row) * board.columns + column, kSide,
                         tag, border);
      tag.copyTo(picture(cv::Rect(right, below, kSide, kSide)));
    }
  return {picture, kSide / board.square, double(margin), double(picture.rows - margin), true};
}

/// Upright in front of the camera, y of the board up; turned about the camera's axes, moved aside.
Transform shown(const BoardPattern& board, const Vec3& turn, const Vec3& centre) {
  const Mat3 R = exp_so3(turn) * Vec3(1, -1, -1).asDiagonal();
  const Vec3 middle = 0.5 * (board.corner(0) + board.corner(board.corners() - 2));
  return {R, centre - R * middle};
}

TEST(AprilGrid, cornersAreFoundWhicheverWayItIsPrinted) {
  const RigCalibration rig = known_rig(1, CameraModelKind::pinhole_radtan);
  const BoardPattern board = parse_aprilgrid("6x6", 0.088, 0.3);
  const Transform T = shown(board, Vec3(0.3, -0.2, 0.1), Vec3(0.02, -0.01, 1.0));
  for (const int border : {1, 2})
    for (const bool from_below : {true, false}) {
      const auto pixels = printed(board, border, from_below).paint(rig.intrinsics[0], T);
      const BoardCorners found =
          find_aprilgrid({pixels.data(), 640, 480, 640}, board, BoardSearch::thorough);
      EXPECT_GT(found.size(), 120U) << "of 144; border " << border << ", below " << from_below;
      expect_corners(found, rig, board, T);
    }
}

TEST(AprilGrid, aPartOfTheBoardIsEnough) {
  const RigCalibration rig = known_rig(1, CameraModelKind::pinhole_radtan);
  const BoardPattern board = parse_aprilgrid("6x6", 0.088, 0.3);
  const test::PrintedBoard painter = printed(board, 2, true);
  // Into the corners of the image, turned, upside down.
  for (const auto& [turn, centre] : {std::pair(Vec3(0.2, 0.2, 0), Vec3(-0.4, -0.3, 0.9)),
                                     std::pair(Vec3(-0.2, 0.1, 0.4), Vec3(0.4, 0.3, 0.9)),
                                     std::pair(Vec3(0.1, -0.2, M_PI), Vec3(0.4, -0.3, 0.9))}) {
    const Transform T = shown(board, turn, centre);
    const auto pixels = painter.paint(rig.intrinsics[0], T);
    const BoardCorners found =
        find_aprilgrid({pixels.data(), 640, 480, 640}, board, BoardSearch::thorough);
    EXPECT_GE(found.size(), 16U);
    EXPECT_LT(found.size(), 120U) << "the board is not cut off: nothing is tested";
    expect_corners(found, rig, board, T);
  }
}

TEST(AprilGrid, anotherBoardOrNoneIsNothing) {
  const RigCalibration rig = known_rig(1, CameraModelKind::pinhole_radtan);
  const BoardPattern board = parse_aprilgrid("6x6", 0.088, 0.3);
  const std::vector<std::uint8_t> grey(640 * 480, 128);
  EXPECT_TRUE(find_aprilgrid({grey.data(), 640, 480, 640}, board, BoardSearch::thorough).empty());
  EXPECT_TRUE(find_aprilgrid({}, board, BoardSearch::thorough).empty());
  const BoardPattern wide = parse_aprilgrid("8x4", 0.06, 0.3);
  const auto pixels =
      printed(wide, 2, true)
          .paint(rig.intrinsics[0], shown(wide, Vec3(0.1, 0.1, 0), Vec3(0, 0, 0.9)));
  EXPECT_FALSE(find_aprilgrid({pixels.data(), 640, 480, 640}, wide, BoardSearch::thorough).empty());
  EXPECT_TRUE(find_aprilgrid({pixels.data(), 640, 480, 640}, board, BoardSearch::thorough).empty())
      << "tags that lie as on a board of other columns";
}

TEST(AprilGrid, onlyGridsThatCanBePrintedArePermitted) {
  EXPECT_EQ(parse_aprilgrid("6x6", 0.088, 0.3).corners(), 144U);
  for (const char* bad : {"", "6", "6x", "0x6", "25x2", "24x24x", "-6x6"})
    EXPECT_THROW((void)parse_aprilgrid(bad, 0.088, 0.3), InputError) << bad;
  for (const double bad : {0.0, -0.3, 3.0, std::nan("")})
    EXPECT_THROW((void)parse_aprilgrid("6x6", 0.088, bad), InputError) << bad;
  // Kalibr's sample sheet: 36 tags of 88 mm, 26.4 mm apart.
  const Vec3 last = parse_aprilgrid("6x6", 0.088, 0.3).corner(4 * 35 + 2);
  EXPECT_NEAR(last.x(), 5 * 0.1144 + 0.088, 1e-12);
  EXPECT_NEAR(last.y(), 5 * 0.1144 + 0.088, 1e-12);
}

}  // namespace
}  // namespace vergence::app
