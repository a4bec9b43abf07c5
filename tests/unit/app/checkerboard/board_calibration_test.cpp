#include "app/checkerboard/board_calibration.hpp"

#include <gtest/gtest.h>

#include "tests/support/refusal.hpp"
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

}  // namespace
}  // namespace vergence::app
