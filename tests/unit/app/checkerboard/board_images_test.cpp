#include "app/checkerboard/board_images.hpp"

#include <gtest/gtest.h>

#include "app/checkerboard/board_detector.hpp"
#include "tests/support/refusal.hpp"
#include "tests/support/temporary_folder.hpp"

namespace vergence::app {
namespace {

using Paths = std::vector<std::filesystem::path>;

TEST(BoardImages, globsGiveSortedFilesOnce) {
  const test::TemporaryFolder folder;
  for (const char* name : {"left2.png", "left1.png", "right1.png"}) (void)folder.write(name, "x");
  const std::string all = (folder / "left*.png").string(), one = (folder / "left1.png").string();
  const Paths files = matching_files({all, one}, "--left");
  EXPECT_EQ(files, (Paths{folder / "left1.png", folder / "left2.png"}));
  EXPECT_THROW((void)matching_files({(folder / "none*.png").string()}, "--left"), InputError);
}

TEST(BoardImages, viewsArePairedByNumberElseByOrder) {
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

TEST(BoardImages, unreadableImagesAreRemarks) {
  const test::TemporaryFolder folder;
  const Paths view{folder.write("left.png", "no image"), folder / "gone.png"};
  const BoardImages images = read_board_images({view}, parse_checkerboard("9x6", 0.1), {});
  EXPECT_TRUE(images.views.empty());
  ASSERT_EQ(images.remarks.size(), 2U);
  EXPECT_TRUE(test::mentions(images.remarks[1], "gone.png is missing"));
}

/// OpenCV throws at a view whose corners determine no homography, and at all views together.
TEST(BoardImages, cornersOnALineHaveNoHomography) {
  const BoardPattern board = parse_charuco("8x7", 0.06, 0.044, "5X5_100");
  const auto determined = [&board](const std::vector<std::size_t>& corners) {
    BoardCorners seen;
    for (const std::size_t index : corners) seen.push_back({index, Vec2::Zero()});
    return determine_a_homography(seen, board);
  };
  EXPECT_TRUE(determined({0, 1, 2, 7, 8, 9}));
  EXPECT_FALSE(determined({0, 1, 2, 7, 8}));
  EXPECT_FALSE(determined({0, 7, 14, 21, 28, 35})) << "a column";
  EXPECT_FALSE(determined({0, 7, 14, 21, 28, 35, 36})) << "all but one";
  EXPECT_FALSE(determined({0, 8, 16, 24, 32, 40})) << "a diagonal";
}

}  // namespace
}  // namespace vergence::app
