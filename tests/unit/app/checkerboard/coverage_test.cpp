#include "app/checkerboard/coverage.hpp"

#include <map>

#include <fmt/ranges.h>

#include "tests/support/mentions.hpp"
#include "tests/unit/app/checkerboard/board_picture.hpp"
#include "tests/unit/app/checkerboard/board_scene.hpp"

namespace vergence::app {
namespace {

using test::contains;

using test::known_rig;
using test::seen_board;
using test::shown_around;

const BoardPattern kBoard = parse_checkerboard("9x6", 0.04);

Coverage nothing_yet(const RigCalibration& rig) {
  return {kBoard, {"left", "right"}, {{640, 480}, {640, 480}}, rig.intrinsics[0].fx};
}

std::string all(const std::vector<std::string>& needs) {
  return fmt::format("{}\n", fmt::join(needs, "\n"));
}

/// Face to face at a place in the left image, in shares of it.
Transform flat(const RigCalibration& rig, double right, double down, double extent,
               const Vec3& turn = Vec3::Zero()) {
  const Intrinsics& lens = rig.intrinsics[0];
  const double width = kBoard.square * (kBoard.columns - 1),
               height = kBoard.square * (kBoard.rows - 1);
  const double far = lens.fx * width / (lens.width * extent);
  const Mat3 R = exp_so3(turn);
  const Vec3 centre(far * right * lens.width / lens.fx, far * down * lens.height / lens.fx, far);
  return {R, centre - R * Vec3(0.5 * width, 0.5 * height, 0)};
}

TEST(Coverage, namesMissingPartsTiltsAndSizes) {
  const RigCalibration rig = known_rig(2, CameraModelKind::pinhole_radtan);
  Coverage c = nothing_yet(rig);
  EXPECT_TRUE(contains(all(c.needs()), "left: every part of the image"));
  c.add(seen_board(rig, kBoard, flat(rig, 0.06, 0, 0.3)));
  const std::string needs = all(c.needs());
  EXPECT_TRUE(contains(needs, "top left")) << needs;
  EXPECT_FALSE(contains(needs, "the middle")) << needs;
  EXPECT_TRUE(
      test::mentions(needs, "nearer\n", "tilted, each edge nearer in turn", "11 more views"));

  // Which edge is the nearer one is asked of the board's own corners.
  const Transform turned = flat(rig, 0.06, 0, 0.3, Vec3(0, 0.4, 0)),
                  tipped = flat(rig, 0.06, 0, 0.3, Vec3(0.4, 0, 0));
  c.add(seen_board(rig, kBoard, turned));
  c.add(seen_board(rig, kBoard, tipped));
  const bool left_nearer = (turned * kBoard.corner(0)).z() < (turned * kBoard.corner(8)).z();
  const bool top_nearer = (tipped * kBoard.corner(0)).z() < (tipped * kBoard.corner(45)).z();
  EXPECT_TRUE(test::mentions(
      all(c.needs()), std::string("tilted, the ") + (left_nearer ? "right" : "left") + " and " +
                          (top_nearer ? "bottom" : "top") + " edges nearer in turn"));
  c.add(seen_board(rig, kBoard, flat(rig, 0.06, 0, 0.45)));
  const auto last = c.needs();
  EXPECT_EQ(std::count(last.begin(), last.end(), "nearer") +
                std::count(last.begin(), last.end(), "farther"),
            0)
      << all(last);
}

TEST(Coverage, cornersWithoutPoseGiveNoTilt) {
  const RigCalibration rig = known_rig(2, CameraModelKind::pinhole_radtan);
  const BoardView whole = seen_board(rig, kBoard, flat(rig, 0.06, 0, 0.3, Vec3(0, 0.4, 0)));
  // The corners of the first row lie on a line.
  for (const std::size_t corners : {3U, 7U}) {
    BoardView few;
    few.corners[0].assign(whole.corners[0].begin(),
                          whole.corners[0].begin() + static_cast<std::ptrdiff_t>(corners));
    Coverage c = nothing_yet(rig);
    EXPECT_NO_THROW((void)c.brings_something(few)) << corners;
    EXPECT_NO_THROW(c.add(few)) << corners;
    EXPECT_TRUE(contains(all(c.needs()), "tilted, each edge nearer in turn")) << all(c.needs());
  }
}

TEST(ViewCollector, takesStillViewsUntilComplete) {
  const RigCalibration rig = known_rig(2, CameraModelKind::pinhole_radtan);
  ViewCollector collector(nothing_yet(rig), 640);
  EXPECT_EQ(collector.offer({}), OfferResult::not_seen);
  std::map<OfferResult, int> verdicts;
  std::size_t poses = 0;
  for (const Transform& T : shown_around(kBoard, rig)) {
    if (collector.complete()) break;
    ++poses;
    const BoardView seen = seen_board(rig, kBoard, T);
    ASSERT_FALSE(seen.corners[0].empty() || seen.corners[1].empty()) << "pose " << poses;
    EXPECT_EQ(collector.offer(seen), OfferResult::moving) << "it was elsewhere a moment ago";
    const OfferResult held = collector.offer(seen);
    EXPECT_TRUE(held == OfferResult::accepted || held == OfferResult::nothing_new);
    EXPECT_EQ(collector.offer(seen), OfferResult::nothing_new)
        << "the same view again tells nothing";
    ++verdicts[held];
  }
  EXPECT_TRUE(collector.complete()) << all(collector.coverage().needs());
  EXPECT_GE(collector.views().size(), kEnoughViews);
  EXPECT_LE(poses, 18U);
}

TEST(ViewCollector, movingBoardIsNotTaken) {
  const RigCalibration rig = known_rig(2, CameraModelKind::pinhole_radtan);
  ViewCollector collector(nothing_yet(rig), 640);
  BoardView seen = seen_board(rig, kBoard, shown_around(kBoard, rig)[4]);
  (void)collector.offer(seen);
  for (int i = 0; i < 5; ++i) {
    // The motion per set in px is above 0.15 % of 640 px.
    for (BoardCorner& c : seen.corners[1]) c.pixel.x() += 1.2;
    EXPECT_EQ(collector.offer(seen), OfferResult::moving);
  }
  for (BoardCorner& c : seen.corners[1]) c.pixel.x() += 0.5;
  EXPECT_EQ(collector.offer(seen), OfferResult::accepted);
}

TEST(ViewCollector, viewOfOneCameraIsNotTaken) {
  const RigCalibration rig = known_rig(2, CameraModelKind::pinhole_radtan);
  ViewCollector collector(nothing_yet(rig), 640);
  BoardView seen = seen_board(rig, kBoard, shown_around(kBoard, rig)[4]);
  seen.corners[1].clear();
  EXPECT_EQ(collector.offer(seen), OfferResult::not_seen);
  EXPECT_EQ(collector.offer(seen), OfferResult::not_seen);
}

/// In drawn images, sharper than any lens makes them, cornerSubPix is off by a tenth of a pixel
/// here and there. Another order would be off by a square, another idea of where a pixel's centre
/// is by half a pixel all together.
TEST(BoardPattern, findsCornersInOrder) {
  const RigCalibration rig = known_rig(1, CameraModelKind::pinhole_radtan);
  const test::BoardPainter painter(rig.intrinsics[0]);
  for (const BoardPattern& board :
       {kBoard, parse_checkerboard("6x9", 0.04), parse_checkerboard("8x6", 0.04)})
    for (const double roll : {0.0, 0.3, M_PI}) {
      const Vec3 middle = 0.5 * (board.corner(0) + board.corner(board.corners() - 1));
      const Mat3 R = exp_so3(Vec3(0.35, -0.2, 0)) * exp_so3(Vec3(0, 0, roll));
      const Transform T{R, Vec3(0.01, -0.02, 0.9) - R * middle};
      const auto pixels = painter.paint(board, T);
      const BoardCorners truth = seen_board(rig, board, T).corners[0];
      const BoardCorners found =
          find_checkerboard({pixels.data(), 640, 480, 640}, board, BoardSearch::quick, truth);
      ASSERT_EQ(truth.size(), found.size()) << board.columns << " roll " << roll;
      Vec2 sum = Vec2::Zero();
      for (std::size_t i = 0; i < truth.size(); ++i) {
        EXPECT_LT((found[i].pixel - truth[i].pixel).norm(), 0.3)
            << i << " is off by " << (found[i].pixel - truth[i].pixel).transpose();
        sum += found[i].pixel - truth[i].pixel;
      }
      EXPECT_LT(sum.norm() / static_cast<double>(truth.size()), 0.05);
    }
}

TEST(BoardPattern, findsNothingWithoutTheBoard) {
  const std::vector<std::uint8_t> grey(640 * 480, 128);
  EXPECT_TRUE(
      find_checkerboard({grey.data(), 640, 480, 640}, kBoard, BoardSearch::thorough).empty());
  EXPECT_TRUE(find_checkerboard({}, kBoard, BoardSearch::thorough).empty());
  const RigCalibration rig = known_rig(1, CameraModelKind::pinhole_radtan);
  const auto other = test::BoardPainter(rig.intrinsics[0])
                         .paint(parse_checkerboard("7x5", 0.04), flat(rig, 0, 0, 0.5));
  EXPECT_TRUE(
      find_checkerboard({other.data(), 640, 480, 640}, kBoard, BoardSearch::thorough).empty())
      << "a smaller board is another";
}

}  // namespace
}  // namespace vergence::app
