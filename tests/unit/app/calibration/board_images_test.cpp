#include "app/calibration/board_images.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "app/calibration/board_detector.hpp"
#include "app/calibration/charuco.hpp"
#include "app/datasets/image_writer.hpp"
#include "app/runtime/errors.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/unit/app/calibration/board_scene.hpp"
#include "tests/unit/app/calibration/charuco_painter.hpp"

namespace vergence::app {
namespace {

using Paths = std::vector<std::filesystem::path>;

TEST(BoardImages, patternsNameFilesInOrderAndOnce) {
  const test::TemporaryFolder folder;
  for (const char* name : {"left2.png", "left1.png", "right1.png"}) (void)folder.write(name, "x");
  const std::string all = (folder / "left*.png").string(), one = (folder / "left1.png").string();
  const Paths files = matching_files({all, one}, "--left");
  EXPECT_EQ(files, (Paths{folder / "left1.png", folder / "left2.png"}));
  EXPECT_THROW((void)matching_files({(folder / "none*.png").string()}, "--left"), InputError);
}

TEST(BoardImages, viewsArePairedByNumberWhereSomeAreMissingElseByOrder) {
  std::vector<std::string> remarks;
  auto views = group_views(
      {{"left01.png", "left02.png", "left04.png"}, {"right01.png", "right03.png", "right04.png"}},
      &remarks);
  EXPECT_EQ(views,
            (std::vector<Paths>{{"left01.png", "right01.png"}, {"left04.png", "right04.png"}}));
  EXPECT_EQ(remarks.size(), 2U);
  remarks.clear();
  views = group_views({{"a10.png", "a11.png"}, {"b20.png", "b21.png"}}, &remarks);
  EXPECT_EQ(views, (std::vector<Paths>{{"a10.png", "b20.png"}, {"a11.png", "b21.png"}}))
      << "numbers that have nothing in common";
  EXPECT_TRUE(remarks.empty());
  views = group_views({{"a.png", "b.png"}, {"c.png", "d.png"}}, &remarks);
  EXPECT_EQ(views[1], (Paths{"b.png", "d.png"}));
  EXPECT_THROW((void)group_views({{"a.png", "b.png"}, {"c.png"}}, &remarks), InputError);
}

TEST(BoardImages, numbersAreEqualWhateverZerosAreInFront) {
  Paths left, right, farther;
  for (int i = 1; i <= 14; ++i) {
    left.emplace_back(fmt::format("left{}.png", i));
    right.emplace_back(fmt::format("right{:02}.png", i));
    farther.emplace_back(fmt::format("right{}.png", 100 + i));
  }
  std::vector<Paths> by_number, by_order;
  for (std::size_t i = 0; i < left.size(); ++i) {
    by_number.push_back({left[i], right[i]});
    by_order.push_back({left[i], farther[i]});
  }
  std::sort(left.begin(), left.end());  // as matching_files() has them: left1, left10, left11 …
  std::vector<std::string> remarks;
  EXPECT_EQ(group_views({left, right}, &remarks), by_number);
  EXPECT_EQ(group_views({left, farther}, &remarks), by_order);
  EXPECT_TRUE(remarks.empty());
  EXPECT_EQ(group_views({{"a0.png", "a00.png"}, {"b0.png", "b1.png"}}, &remarks)[0],
            (Paths{"a0.png", "b0.png"}))
      << "two of one number";
}

TEST(BoardImages, imagesThatCannotBeReadAreRemarks) {
  const test::TemporaryFolder folder;
  const Paths view{folder.write("left.png", "no image"), folder / "gone.png"};
  const BoardImages images = read_board_images({view}, parse_checkerboard("9x6", 0.1), {});
  EXPECT_TRUE(images.views.empty());
  ASSERT_EQ(images.remarks.size(), 2U);
  EXPECT_NE(images.remarks[1].find("gone.png is missing"), std::string::npos) << images.remarks[1];
}

/// A ChArUco board in front of one camera without distortion, so that its lines are straight.
class CharucoImages : public ::testing::Test {
 protected:
  static Intrinsics straight_lens() {
    Intrinsics lens = test::known_rig(1, CameraModelKind::pinhole_radtan).intrinsics[0];
    lens.distortion.fill(0);
    return lens;
  }
  [[nodiscard]] std::vector<std::uint8_t> paint(const Vec3& turn, const Vec3& centre) const {
    return painter.paint(lens, test::shown_charuco(board, turn, centre));
  }
  [[nodiscard]] ImageView view(const std::vector<std::uint8_t>& pixels) const {
    return {pixels.data(), lens.width, lens.height, lens.width};
  }
  [[nodiscard]] std::filesystem::path write(const std::string& name,
                                            const std::vector<std::uint8_t>& pixels) const {
    write_png(folder / name, view(pixels));
    return folder / name;
  }
  /// Tilted to all sides, in the parts of the image in turn.
  [[nodiscard]] std::vector<Paths> good_views() const {
    std::vector<Paths> views;
    for (int i = 0; i < 12; ++i) {
      const Vec3 turn = 0.5 * Vec3(std::cos(2.1 * i), std::sin(2.1 * i), 0.1);
      const Vec3 centre(0.12 * (i % 3 - 1), 0.09 * (i / 3 % 3 - 1), 0.7 + 0.05 * (i % 4));
      views.push_back({write(fmt::format("good{}.png", i), paint(turn, centre))});
    }
    return views;
  }
  /// The middle of the board where only one line of its corners is in the image and away from its
  /// edge: the second line of squares, which has the fourth marker, ends `kCut` px within the edge.
  [[nodiscard]] Vec3 strip_at(bool right_edge) const {
    constexpr double kDepth = 0.75, kCut = 4;
    const double lines = 0.5 * (board.columns + 1) - 2;  // from the middle to that line
    const double aside = lines * board.square;
    const double u = right_edge ? lens.width - kCut : kCut;
    return {(u - lens.cx) / lens.fx * kDepth + (right_edge ? aside : -aside), 0, kDepth};
  }

  const test::TemporaryFolder folder{};
  const Intrinsics lens = straight_lens();
  const BoardPattern board = parse_charuco("8x7", 0.06, 0.044, "5X5_100");
  const test::CharucoPainter painter{board, true};
};

TEST_F(CharucoImages, viewsWithTooLittleOfTheBoardAreSaidAndSkippedAndSpoilNothing) {
  const std::vector<Paths> good = good_views();
  std::vector<Paths> all = good;
  for (const bool right : {true, false}) {
    const auto strip = paint(Vec3::Zero(), strip_at(right));
    const BoardCorners line = find_charuco(view(strip), board);
    ASSERT_GE(line.size(), 4U) << "nothing is there: nothing is tested";
    for (const BoardCorner& c : line)
      ASSERT_EQ(board.corner(c.index).x(), board.corner(line[0].index).x()) << "more than a line";
    EXPECT_TRUE(find_board(view(strip), board, BoardSearch::quick, {}).empty());
    all.push_back({write(right ? "strip1.png" : "strip2.png", strip)});
  }
  const BoardImages images = read_board_images(all, board, {});
  EXPECT_EQ(images.views.size(), good.size());
  ASSERT_EQ(images.remarks.size(), 2U);
  EXPECT_NE(images.remarks[0].find("too little of it, in " + (folder / "strip1.png").string() +
                                   "; skipped"),
            std::string::npos)
      << images.remarks[0];
  EXPECT_NE(images.remarks[1].find("strip2.png; skipped"), std::string::npos) << images.remarks[1];

  BoardCalibrationOptions options;
  options.board = board;
  options.sizes = images.sizes;
  const BoardCalibration c = calibrate_boards(images.views, options);
  EXPECT_EQ(c.error, "");
  EXPECT_EQ(c.rig.frames, 12);
  const BoardCalibration without =
      calibrate_boards(read_board_images(good, board, {}).views, options);
  EXPECT_EQ(c.rig.intrinsics[0].fx, without.rig.intrinsics[0].fx);
}

}  // namespace
}  // namespace vergence::app
