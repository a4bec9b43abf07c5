// Boards whose markers tell their corners apart: ChArUco and AprilGrid.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>

#include <opencv2/aruco.hpp>

#include "app/checkerboard/board_detector.hpp"
#include "app/runtime/errors.hpp"
#include "tests/unit/app/checkerboard/board_scene.hpp"

namespace vergence::app {
namespace {

using test::known_rig;

constexpr int kWidth = 640, kHeight = 480;
const BoardPattern kCharuco = parse_charuco("8x7", 0.06, 0.044, "DICT_5X5_100"),
                   kAprilGrid = parse_aprilgrid("6x6", 0.088, 0.3);

BoardCorners found_in(const std::vector<std::uint8_t>& pixels, const BoardPattern& board) {
  const ImageView image{pixels.data(), kWidth, kHeight, kWidth};
  return board.kind == BoardKind::charuco ? find_charuco(image, board)
                                          : find_aprilgrid(image, board, BoardSearch::thorough);
}

/// A flat board of black and white as it is printed.
struct PrintedBoard {
  /// The sheet has a margin; everything around it is grey.
  cv::Mat sheet;
  /// Pixels of the sheet per metre.
  double scale;
  /// The board's origin on the sheet in px.
  double x, y;
  bool y_up = false;

  /// As a camera sees it: each pixel is the mean over a grid of points within it.
  [[nodiscard]] std::vector<std::uint8_t> paint(const Intrinsics& lens,
                                                const Transform& T_camera_board) const {
    constexpr int kSteps = 4;
    const Camera camera(lens);
    const Transform T_board_camera = T_camera_board.inverse();
    std::vector<std::uint8_t> pixels;
    for (int v = 0; v < lens.height; ++v)
      for (int u = 0; u < lens.width; ++u) {
        Vec3 ray(0, 0, 1), right(0, 0, 1), below(0, 0, 1);
        (void)camera.unproject({u - 0.0, v - 0.0}, &ray);
        (void)camera.unproject({u + 1.0, v - 0.0}, &right);
        (void)camera.unproject({u - 0.0, v + 1.0}, &below);
        double sum = 0;
        for (int i = 0; i < kSteps * kSteps; ++i) {
          const double along = (i % kSteps + 0.5) / kSteps - 0.5,
                       down = (i / kSteps + 0.5) / kSteps - 0.5;
          const Vec3 d =
              T_board_camera.R * Vec3(ray + along * (right - ray) + down * (below - ray));
          const double depth = -T_board_camera.t.z() / d.z();
          sum += grey(depth > 0 ? Vec3(T_board_camera.t + depth * d) : Vec3(1e6, 1e6, 0));
        }
        pixels.push_back(static_cast<std::uint8_t>(sum / (kSteps * kSteps) + 0.5));
      }
    return pixels;
  }

 private:
  [[nodiscard]] double grey(const Vec3& p) const {
    const double u = x + scale * p.x(), v = y + (y_up ? -scale : scale) * p.y();
    if (!(u >= 0 && v >= 0 && u < sheet.cols && v < sheet.rows)) return 110;
    return sheet.at<std::uint8_t>(static_cast<int>(v), static_cast<int>(u)) > 127 ? 220 : 30;
  }
};

// In drawn images cornerSubPix is off by a tenth of a pixel here and there, as for checkerboards; a
// wrong index would be a side of a tag or a square, 20 px.
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

/// `black_first`: the upper left square is black.
PrintedBoard printed_charuco(const BoardPattern& board, bool black_first) {
  // Both lengths are in px.
  constexpr int kSquare = 120, kMargin = 36;
  const auto dictionary = cv::aruco::getPredefinedDictionary(static_cast<int>(board.dictionary));
  const int columns = board.columns + 1, rows = board.rows + 1;
  cv::Mat sheet(rows * kSquare + 2 * kMargin, columns * kSquare + 2 * kMargin, CV_8U,
                cv::Scalar(255));
  const int side = static_cast<int>(std::lround(kSquare * board.marker / board.square));
  const int gap = (kSquare - side) / 2;
  int id = 0;
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) {
      cv::Mat square =
          sheet(cv::Rect(kMargin + column * kSquare, kMargin + row * kSquare, kSquare, kSquare));
      cv::Mat marker;
      if (((row + column) % 2 == 0) == black_first) {
        square.setTo(0);
      } else {
        dictionary->drawMarker(id++, side, marker, 1);
        marker.copyTo(square(cv::Rect(gap, gap, side, side)));
      }
    }
  return {sheet, kSquare / board.square, kMargin + kSquare, kMargin + kSquare};
}

/// `border`: black cells around a tag's code; `from_below`: tag 0 at the lower left.
PrintedBoard printed_aprilgrid(const BoardPattern& board, int border, bool from_below) {
  // Side of a tag in px.
  constexpr int kSide = 80;
  const auto family = cv::aruco::getPredefinedDictionary(cv::aruco::DICT_APRILTAG_36h11);
  const int gap = static_cast<int>(std::lround(kSide * board.spacing)), pitch = kSide + gap,
            margin = 2 * gap;
  cv::Mat sheet(board.rows * pitch - gap + 2 * margin, board.columns * pitch - gap + 2 * margin,
                CV_8U, cv::Scalar(255));
  // A small square where the corners of four tags meet, and as much of it at the rim.
  for (int row = 0; row <= board.rows; ++row)
    for (int column = 0; column <= board.columns; ++column) {
      const int right = margin + column * pitch, below = margin + row * pitch;
      sheet(cv::Rect(right - gap, below - gap, gap, gap)).setTo(0);
      if (row == board.rows || column == board.columns) continue;
      cv::Mat tag;
      family->drawMarker((from_below ? board.rows - 1 - row : row) * board.columns + column, kSide,
                         tag, border);
      tag.copyTo(sheet(cv::Rect(right, below, kSide, kSide)));
    }
  return {sheet, kSide / board.square, double(margin), double(sheet.rows - margin), true};
}

/// Upright in front of the camera, its middle at `centre`, turned about the camera's axes.
Transform shown(const BoardPattern& board, const Vec3& turn, const Vec3& centre) {
  // The y axis of an AprilGrid points up.
  const bool grid = board.kind == BoardKind::aprilgrid;
  const Mat3 R = grid ? Mat3(exp_so3(turn) * Vec3(1, -1, -1).asDiagonal()) : exp_so3(turn);
  return {R,
          centre - R * (0.5 * (board.corner(0) + board.corner(board.corners() - (grid ? 2 : 1))))};
}

TEST(MarkedBoard, findsCornersOfEveryLayout) {
  const RigCalibration rig = known_rig(1, CameraModelKind::pinhole_radtan);
  const BoardPattern even = parse_charuco("9x6", 0.06, 0.044, "6x6_250");
  struct Print {
    BoardPattern board;
    PrintedBoard printed;
    /// Distance in m.
    double distance;
    /// Minimum number of corners found.
    std::size_t least;
  };
  for (const Print& p : {Print{kCharuco, printed_charuco(kCharuco, true), 0.75, 38},
                         Print{even, printed_charuco(even, true), 0.75, 37},
                         Print{even, printed_charuco(even, false), 0.75, 37},
                         Print{kAprilGrid, printed_aprilgrid(kAprilGrid, 1, true), 1, 121},
                         Print{kAprilGrid, printed_aprilgrid(kAprilGrid, 1, false), 1, 121},
                         Print{kAprilGrid, printed_aprilgrid(kAprilGrid, 2, true), 1, 121},
                         Print{kAprilGrid, printed_aprilgrid(kAprilGrid, 2, false), 1, 121}}) {
    const Transform T = shown(p.board, Vec3(0.3, -0.2, 0.1), Vec3(0.02, -0.01, p.distance));
    const BoardCorners found = found_in(p.printed.paint(rig.intrinsics[0], T), p.board);
    EXPECT_GE(found.size(), p.least) << p.board.describe();
    expect_corners(found, rig, p.board, T);
  }
}

TEST(MarkedBoard, findsCornersOfAPartialBoard) {
  const RigCalibration rig = known_rig(1, CameraModelKind::pinhole_radtan);
  const PrintedBoard charuco = printed_charuco(kCharuco, true),
                     grid = printed_aprilgrid(kAprilGrid, 2, true);
  struct View {
    const BoardPattern& board;
    const PrintedBoard& printed;
    Vec3 turn, centre;
    std::size_t least;
  };
  // Into the corners of the image, turned, upside down.
  for (const View& v : {View{kCharuco, charuco, {0.2, 0.2, 0}, {-0.3, -0.22, 0.65}, 8},
                        View{kCharuco, charuco, {0.1, -0.2, M_PI}, {0.3, -0.2, 0.65}, 8},
                        View{kAprilGrid, grid, {0.2, 0.2, 0}, {-0.4, -0.3, 0.9}, 16},
                        View{kAprilGrid, grid, {-0.2, 0.1, 0.4}, {0.4, 0.3, 0.9}, 16},
                        View{kAprilGrid, grid, {0.1, -0.2, M_PI}, {0.4, -0.3, 0.9}, 16}}) {
    const Transform T = shown(v.board, v.turn, v.centre);
    const BoardCorners found = found_in(v.printed.paint(rig.intrinsics[0], T), v.board);
    EXPECT_GE(found.size(), v.least) << v.board.describe();
    EXPECT_LT(found.size(), v.board.corners() * 5 / 6) << "it is not cut off: nothing is tested";
    expect_corners(found, rig, v.board, T);
  }
}

TEST(MarkedBoard, findsNothingOnAnotherBoard) {
  const RigCalibration rig = known_rig(1, CameraModelKind::pinhole_radtan);
  const BoardPattern wide = parse_aprilgrid("8x4", 0.06, 0.3);
  EXPECT_TRUE(find_charuco({}, kCharuco).empty());
  EXPECT_TRUE(find_aprilgrid({}, kAprilGrid, BoardSearch::thorough).empty());
  for (const BoardPattern& board : {kCharuco, kAprilGrid})
    EXPECT_TRUE(found_in(std::vector<std::uint8_t>(kWidth * kHeight, 128), board).empty());
  const auto charuco =
      printed_charuco(kCharuco, true)
          .paint(rig.intrinsics[0], shown(kCharuco, Vec3(0.1, 0.1, 0), Vec3(0, 0, 0.75)));
  EXPECT_FALSE(found_in(charuco, kCharuco).empty());
  EXPECT_TRUE(found_in(charuco, parse_charuco("6x9", 0.06, 0.044, "5X5_100")).empty())
      << "markers that lie as on a board of other columns";
  EXPECT_TRUE(found_in(charuco, parse_charuco("8x7", 0.06, 0.044, "4X4_50")).empty())
      << "markers of another dictionary";
  const auto grid = printed_aprilgrid(wide, 2, true)
                        .paint(rig.intrinsics[0], shown(wide, Vec3(0.1, 0.1, 0), Vec3(0, 0, 0.9)));
  EXPECT_FALSE(found_in(grid, wide).empty());
  EXPECT_TRUE(found_in(grid, kAprilGrid).empty()) << "tags that lie as on a board of other columns";
}

TEST(Charuco, ignoresForeignMarkers) {
  const RigCalibration rig = known_rig(1, CameraModelKind::pinhole_radtan);
  const BoardPattern& board = kCharuco;
  const Transform T = shown(board, Vec3(0.3, -0.2, 0.1), Vec3(0.02, -0.01, 0.85));
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

TEST(Charuco, refusesImpossibleBoards) {
  const BoardPattern board = parse_charuco("11x8", 0.03, 0.022, "dict_4x4_250");
  EXPECT_EQ(board.corners(), 70U);
  EXPECT_EQ(kMarkerDictionaries[board.dictionary], "4X4_250");
  EXPECT_EQ(board.describe(), "11x8 squares with markers 4X4_250");
  for (const char* bad : {"", "11", "11x", "2x8", "101x8"})
    EXPECT_THROW((void)parse_charuco(bad, 0.03, 0.022, "4X4_250"), InputError) << bad;
  for (const double bad : {0.0, -0.02, 0.03, std::nan("")})
    EXPECT_THROW((void)parse_charuco("11x8", 0.03, bad, "4X4_250"), InputError) << bad;
  for (const char* bad : {"", "4X4", "DICT_", "8X8_50"})
    EXPECT_THROW((void)parse_charuco("11x8", 0.03, 0.022, bad), InputError) << bad;
}

TEST(AprilGrid, refusesImpossibleGrids) {
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
