#include "app/checkerboard/board_calibration.hpp"

#include "app/checkerboard/board_detector.hpp"
#include "app/checkerboard/board_images.hpp"
#include "tests/support/refusal.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/unit/app/checkerboard/board_scene.hpp"

namespace vergence::app {
namespace {

using test::board_options;
using test::board_views;
using test::known_rig;
using test::place_error;

const BoardPattern kBoard = parse_checkerboard("9x6", 0.04);
/// Noise of a corner in px.
constexpr double kNoise = 0.1;

/// Every number of the rig within so many of its own sigmas.
void expect_recovered(const BoardCalibration& c, const RigCalibration& truth, double sigmas) {
  ASSERT_EQ(c.error, "");
  for (std::size_t k = 0; k < static_cast<std::size_t>(truth.cameras); ++k) {
    SCOPED_TRACE(k);
    const Intrinsics &found = c.rig.intrinsics[k], &real = truth.intrinsics[k];
    const std::array off{found.fx - real.fx, found.fy - real.fy, found.cx - real.cx,
                         found.cy - real.cy};
    for (std::size_t i = 0; i < 4; ++i) {
      EXPECT_LT(std::abs(off[i]), sigmas * found.sigma[i]) << i;
      EXPECT_LT(std::abs(found.distortion[i] - real.distortion[i]),
                sigmas * found.distortion_sigma[i])
          << i;
    }
    if (k == 0) continue;
    const Vec6 e = place_error(c.rig.T_camera_left[k], truth.T_camera_left[k]);
    for (int i = 0; i < 6; ++i)
      EXPECT_LT(std::abs(e(i)), sigmas * c.rig.sigma_total[k][static_cast<std::size_t>(i)]) << i;
  }
}

struct RigCase {
  const char* name;
  int cameras;
  CameraModelKind model;
  /// The last camera misses some views and some corners.
  bool gaps;
};
class BoardCalibrationOf : public ::testing::TestWithParam<RigCase> {};

// A jackknife over ten groups knows its sigmas to a quarter: four of them are three true ones.
TEST_P(BoardCalibrationOf, rigIsWithinItsSigmas) {
  const RigCase& p = GetParam();
  const RigCalibration truth = known_rig(p.cameras, p.model);
  auto views = board_views(truth, kBoard, 15, kNoise, 3);
  ASSERT_EQ(views.size(), 15U);
  const auto last = static_cast<std::size_t>(p.cameras - 1);
  for (std::size_t v = 0; p.gaps && v < 8; ++v)
    if (v < 4)
      views[v].corners[last].clear();
    else
      views[v].corners[last].resize(20 + v);
  const BoardCalibration c = calibrate_boards(views, board_options(truth, kBoard));
  expect_recovered(c, truth, 4);
  EXPECT_EQ(c.rig.frames, 15);
  EXPECT_EQ(c.cameras[last].images, p.gaps ? 11 : 15);
  if (p.cameras == 1) return;
  const Vec6 e = place_error(c.rig.T_camera_left[1], truth.T_camera_left[1]);
  EXPECT_LT(e.head<3>().norm(), 0.1 * M_PI / 180);
  EXPECT_LT(e.tail<3>().norm(), 4e-4) << "m";
  EXPECT_NEAR(c.rig.baseline, truth.baseline, 4 * c.rig.baseline_sigma);
}

INSTANTIATE_TEST_SUITE_P(
    Rigs, BoardCalibrationOf,
    ::testing::Values(RigCase{"one", 1, CameraModelKind::pinhole_radtan, false},
                      RigCase{"radtan", 2, CameraModelKind::pinhole_radtan, false},
                      RigCase{"gaps", 2, CameraModelKind::pinhole_radtan, true},
                      RigCase{"equidistant", 2, CameraModelKind::pinhole_equidistant, false},
                      RigCase{"equidistant_gaps", 2, CameraModelKind::pinhole_equidistant, true},
                      RigCase{"three", 3, CameraModelKind::pinhole_radtan, true}),
    [](const auto& of_case) { return of_case.param.name; });

TEST(BoardCalibration, sigmasCoverErrorsOverSeeds) {
  constexpr int kSeeds = 6;
  const RigCalibration truth = known_rig(2, CameraModelKind::pinhole_radtan);
  double squared = 0;
  for (std::uint64_t seed = 100; seed < 100 + kSeeds; ++seed) {
    const auto views = board_views(truth, kBoard, 12, kNoise, seed);
    const BoardCalibration c = calibrate_boards(views, board_options(truth, kBoard));
    ASSERT_EQ(c.error, "");
    const Vec6 e = place_error(c.rig.T_camera_left[1], truth.T_camera_left[1]);
    for (int i = 0; i < 6; ++i) {
      const auto at = static_cast<std::size_t>(i);
      squared += std::pow(e(i) / c.rig.sigma_total[1][at], 2) / (6 * kSeeds);
      EXPECT_GT(c.rig.sigma_total[1][at], 0.5 * c.rig.sigma_noise[1][at]);
    }
  }
  // The mean of 36 values, of which the six of one seed are correlated.
  EXPECT_GT(squared, 0.3);
  EXPECT_LT(squared, 2.5);
}

/// Errors common to a view's corners are no noise: here every left image is stretched by
/// an amount of its own.
TEST(BoardCalibration, lensSigmaIncludesCorrelatedErrors) {
  const RigCalibration truth = known_rig(2, CameraModelKind::pinhole_radtan);
  auto views = board_views(truth, kBoard, 15, 0.02, 21);
  const double of_noise =
      calibrate_boards(views, board_options(truth, kBoard)).rig.intrinsics[0].sigma[0];
  Random random(3, 1);
  for (BoardView& view : views) {
    const Vec2 stretch = Vec2(1, 1) + 5e-4 * Vec2(random.normal(), random.normal());
    for (BoardCorner& corner : view.corners[0]) corner.pixel = corner.pixel.cwiseProduct(stretch);
  }
  const BoardCalibration c = calibrate_boards(views, board_options(truth, kBoard));
  ASSERT_EQ(c.error, "");
  EXPECT_GT(c.rig.intrinsics[0].sigma[0], 2 * of_noise);
  EXPECT_EQ(c.rig.intrinsics[0].distortion_sigma[4], 0) << "k3 is not estimated";
}

TEST(BoardCalibration, rejectsOnlyInconsistentViews) {
  const RigCalibration truth = known_rig(2, CameraModelKind::pinhole_radtan);
  auto views = board_views(truth, kBoard, 14, kNoise, 9);
  // These two views get the corners of each other's right image.
  std::swap(views[4].corners[1], views[5].corners[1]);
  // The board moved between the exposures of view 7.
  for (BoardCorner& corner : views[7].corners[1]) corner.pixel.y() += 2.5;
  const BoardCalibration c = calibrate_boards(views, board_options(truth, kBoard));
  expect_recovered(c, truth, 4);
  for (std::size_t v = 0; v < 14; ++v) EXPECT_EQ(c.views[v].used, v != 4 && v != 5 && v != 7) << v;
  EXPECT_GT(c.views[4].rms_px, 5);
}

TEST(BoardCalibration, swappedCamerasAreAnError) {
  const RigCalibration truth = known_rig(2, CameraModelKind::pinhole_radtan);
  auto views = board_views(truth, kBoard, 10, kNoise, 11);
  for (BoardView& v : views) std::swap(v.corners[0], v.corners[1]);
  const BoardCalibration c = calibrate_boards(views, board_options(truth, kBoard));
  EXPECT_TRUE(test::mentions(c.error, "swapped"));
}

TEST(BoardCalibration, refusesTwoViews) {
  const RigCalibration truth = known_rig(2, CameraModelKind::pinhole_radtan);
  EXPECT_THROW((void)calibrate_boards(board_views(truth, kBoard, 2, kNoise, 12),
                                      board_options(truth, kBoard)),
               InputError);
}

TEST(BoardPattern, refusesAmbiguousCheckerboards) {
  EXPECT_EQ(parse_checkerboard("9x6", 0.1).corners(), 54U);
  for (const char* bad :
       {"", "9", "9x", "x6", "9x6x", "9 x 6", "2x6", "-9x6", "1000x6", "6x6", "9X6"})
    EXPECT_THROW((void)parse_checkerboard(bad, 0.1), InputError) << bad;
  for (const double bad : {0.0, -0.1, 25.0, std::nan("")})
    EXPECT_THROW((void)parse_checkerboard("9x6", bad), InputError) << bad;
  EXPECT_TRUE(parse_checkerboard("9x6", 0.1).is_asymmetric());
  EXPECT_FALSE(parse_checkerboard("8x6", 0.1).is_asymmetric());
}

using Paths = std::vector<std::filesystem::path>;

TEST(BoardImages, globsGiveSortedFilesOnce) {
  const test::TemporaryFolder folder;
  for (const char* name : {"left/2.png", "left/1.png", "right1.png"}) (void)folder.write(name, "x");
  const std::string all = (folder / "left").string(), one = (folder / "left/1*").string();
  const Paths files = matching_files({all, one}, "--left");
  EXPECT_EQ(files, (Paths{folder / "left/1.png", folder / "left/2.png"}));
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

// Thirteen pairs of a chessboard whose calibration by OpenCV is known
// (checkerboards/opencv/README.md of the shared data).

namespace fs = std::filesystem;
constexpr const char* kFolder = "data/checkerboards/opencv";
constexpr double kDegree = M_PI / 180;

BoardCalibrationOptions options() {
  BoardCalibrationOptions o;
  o.board = parse_checkerboard("9x6", 0.025);
  o.sizes = {{640, 480}, {640, 480}};
  return o;
}

TEST(KnownAnswers, imagesGiveTheKnownCalibration) {
  const auto folder = test::shared_data(kFolder);
  if (!folder) GTEST_SKIP() << test::shared_data_missing(kFolder);
  std::vector<std::string> remarks;
  const auto files = group_views({matching_files({(*folder / "left*.jpg").string()}, "--left"),
                                  matching_files({(*folder / "right*.jpg").string()}, "--right")},
                                 &remarks);
  EXPECT_TRUE(remarks.empty());
  const BoardImages images = read_board_images(files, options().board, {});
  EXPECT_TRUE(images.remarks.empty()) << images.remarks.front();
  ASSERT_EQ(images.views.size(), 13U) << "the board is found in all 26 images";
  const BoardCalibration c = calibrate_boards(images.views, options());
  ASSERT_EQ(c.error, "");
  // The corners are refined in another window than the listed ones: "within 0.5 mm and 0.15° is the
  // same answer", rms up to 0.25 px.
  EXPECT_LE(c.rig.reprojection_px, 0.2153) << "not worse than the listed corners";
  EXPECT_EQ(c.rig.frames, 13);
  const Vec3 t = 1e3 * c.rig.T_camera_left[1].t, r = log_so3(c.rig.T_camera_left[1].R) / kDegree;
  EXPECT_LT((t - Vec3(-83.178, 0.918, -0.119)).norm(), 0.5) << t.transpose();
  EXPECT_LT((r - Vec3(0.4102, 0.2449, -0.2010)).norm(), 0.15) << r.transpose();
  for (std::size_t k = 0; k < 2; ++k)
    EXPECT_NEAR(c.rig.intrinsics[k].fx, k == 0 ? 533.5633 : 536.8943, 3 * 0.7)
        << "listed sigmas 0.61, 0.70";
}

}  // namespace
}  // namespace vergence::app
