#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <memory>

#include <apriltag/apriltag.h>
#include <apriltag/tag36h11.h>

#include "app/calibration/aprilgrid.hpp"
#include "app/runtime/errors.hpp"
#include "tests/unit/app/calibration/board_painter.hpp"
#include "tests/unit/app/calibration/board_scene.hpp"

namespace vergence::app {
namespace {

using test::known_rig;

/// An AprilGrid as it is printed, drawn as a camera sees it.
class GridPainter {
 public:
  /// `border`: black cells around a tag's code; `from_below`: tag 0 at the lower left.
  GridPainter(const BoardPattern& board, std::size_t border, bool from_below)
      : board_(board), border_(border), from_below_(from_below) {
    const std::unique_ptr<apriltag_family_t, void (*)(apriltag_family_t*)> family(tag36h11_create(),
                                                                                  tag36h11_destroy);
    for (std::size_t id = 0; id < board.corners() / 4; ++id) {
      image_u8_t* const image = apriltag_to_image(family.get(), static_cast<std::uint32_t>(id));
      for (std::size_t row = 0; row < kCode; ++row)
        for (std::size_t column = 0; column < kCode; ++column)
          white_.push_back(
              image->buf[(row + 2) * static_cast<std::size_t>(image->stride) + column + 2] > 127);
      std::free(image->buf);  // the library that makes it has no function for it
      std::free(image);
    }
  }

  [[nodiscard]] std::vector<std::uint8_t> paint(const Intrinsics& lens,
                                                const Transform& T_camera_board) const {
    return test::paint_board(lens, T_camera_board, [this](double x, double y) {
      return grey(x / board_.square, y / board_.square);
    });
  }

 private:
  static constexpr std::size_t kCode = 6;  // cells a side
  static constexpr double kWhite = test::kPaintedWhite, kBlack = test::kPaintedBlack,
                          kGrey = test::kPaintedGrey;

  /// x to the right and y up, in sides of a tag from the lower left corner.
  [[nodiscard]] double grey(double x, double y) const {
    const double gap = board_.spacing, pitch = 1 + gap;
    const double width = board_.columns * pitch - gap, height = board_.rows * pitch - gap;
    const double margin = 2 * gap;
    if (x < -margin || y < -margin || x > width + margin || y > height + margin) return kGrey;
    const double column = std::floor(x / pitch), row = std::floor(y / pitch);
    const double u = x - column * pitch, v = y - row * pitch;
    const bool across = column >= 0 && column < board_.columns && row >= 0 && row < board_.rows;
    if (across && u < 1 && v < 1) return of_tag(column, row, u, v);
    // A small square where the corners of four tags meet, and as much of it at the rim.
    const bool in_column = u >= 1 || x < 0, in_row = v >= 1 || y < 0;
    return in_column && in_row && x > -gap && y > -gap && x < width + gap && y < height + gap
               ? kBlack
               : kWhite;
  }
  [[nodiscard]] double of_tag(double column, double row, double u, double v) const {
    const double up = from_below_ ? row : board_.rows - 1 - row;
    const auto id = static_cast<std::size_t>(up * board_.columns + column);
    const auto cells = static_cast<double>(kCode + 2 * border_);
    const auto across = static_cast<std::size_t>(u * cells),
               down = static_cast<std::size_t>((1 - v) * cells);
    if (across < border_ || down < border_ || across >= kCode + border_ || down >= kCode + border_)
      return kBlack;
    return white_[(id * kCode + down - border_) * kCode + across - border_] ? kWhite : kBlack;
  }

  BoardPattern board_;
  std::size_t border_;
  bool from_below_;
  std::vector<bool> white_;  // of each tag, row by row from the top
};

/// Upright in front of the camera, y of the board up; turned about the camera's axes, moved aside.
Transform shown(const BoardPattern& board, const Vec3& turn, const Vec3& centre) {
  const Mat3 R = exp_so3(turn) * Vec3(1, -1, -1).asDiagonal();
  const Vec3 middle = 0.5 * (board.corner(0) + board.corner(board.corners() - 2));
  return {R, centre - R * middle};
}

// In drawn images cornerSubPix is off by a tenth of a pixel here and there, as for checkerboards; a
// wrong number would be a tag's side, 20 px.
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

TEST(AprilGrid, cornersAreFoundWhicheverWayItIsPrinted) {
  const RigCalibration rig = known_rig(1, CameraModelKind::pinhole_radtan);
  const BoardPattern board = parse_aprilgrid("6x6", 0.088, 0.3);
  const Transform T = shown(board, Vec3(0.3, -0.2, 0.1), Vec3(0.02, -0.01, 1.0));
  for (const std::size_t border : {1U, 2U})
    for (const bool from_below : {true, false}) {
      const auto pixels = GridPainter(board, border, from_below).paint(rig.intrinsics[0], T);
      const BoardCorners found =
          find_aprilgrid({pixels.data(), 640, 480, 640}, board, BoardSearch::thorough);
      EXPECT_GT(found.size(), 120U) << "of 144; border " << border << ", below " << from_below;
      expect_corners(found, rig, board, T);
    }
}

TEST(AprilGrid, aPartOfTheBoardIsEnough) {
  const RigCalibration rig = known_rig(1, CameraModelKind::pinhole_radtan);
  const BoardPattern board = parse_aprilgrid("6x6", 0.088, 0.3);
  const GridPainter painter(board, 2, true);
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
      GridPainter(wide, 2, true)
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
