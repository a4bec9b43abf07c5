#include "app/calibration/board_calibration.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

#include "app/config/calibration_file.hpp"
#include "app/runtime/errors.hpp"
#include "tests/unit/app/calibration/board_scene.hpp"

namespace vergence::app {
namespace {

using test::board_options;
using test::board_scene;
using test::BoardScene;
using test::known_rig;
using test::place_error;

const BoardPattern kBoard = parse_checkerboard("9x6", 0.04);
constexpr double kNoise = 0.1;  // px

/// Every number of the rig within so many of its own sigmas, those by noise.
void expect_recovered(const BoardCalibration& c, const RigCalibration& truth, double sigmas) {
  ASSERT_EQ(c.error, "");
  for (std::size_t k = 0; k < static_cast<std::size_t>(truth.cameras); ++k) {
    const Intrinsics &found = c.rig.intrinsics[k], &real = truth.intrinsics[k];
    const std::array off{found.fx - real.fx, found.fy - real.fy, found.cx - real.cx,
                         found.cy - real.cy};
    for (std::size_t i = 0; i < 4; ++i)
      EXPECT_LT(std::abs(off[i]), sigmas * c.cameras[k].noise[i])
          << "camera " << k << " intrinsics " << i;
    for (std::size_t i = 0; i < 4; ++i)
      EXPECT_LT(std::abs(found.distortion[i] - real.distortion[i]),
                sigmas * c.cameras[k].noise[4 + i])
          << k << " " << i;
    if (k == 0) continue;
    const Vec6 e = place_error(c.rig.T_camera_left[k], truth.T_camera_left[k]);
    for (int i = 0; i < 6; ++i)
      EXPECT_LT(std::abs(e(i)), sigmas * c.rig.sigma_wide[k][static_cast<std::size_t>(i)])
          << "camera " << k << " place " << i;
  }
}

// 26 to 42 numbers a case: one in 10⁴ of a normal distribution lies outside 4 sigma, one in 400
// outside 3. The seeds are fixed.
TEST(BoardCalibration, aStereoRigIsRecoveredWithinItsSigmas) {
  for (const auto kind : {CameraModelKind::pinhole_radtan, CameraModelKind::pinhole_equidistant}) {
    const RigCalibration truth = known_rig(2, kind);
    const BoardScene scene = board_scene(truth, kBoard, 15, kNoise, 3);
    ASSERT_EQ(scene.views.size(), 15U);
    const BoardCalibration c = calibrate_boards(scene.views, board_options(truth, kBoard));
    expect_recovered(c, truth, 3);
    EXPECT_NEAR(c.corner_sigma_px / kNoise, 1, 0.06);  // 3240 coordinates: 1.3 % is one sigma
    EXPECT_NEAR(c.rig.baseline, truth.baseline, 3 * c.rig.baseline_sigma);
    EXPECT_EQ(c.rig.frames, 15);
  }
}

TEST(BoardCalibration, threeCamerasAreRecoveredAlsoWhereOneMissesSomeViews) {
  const RigCalibration truth = known_rig(3, CameraModelKind::pinhole_radtan);
  BoardScene scene = board_scene(truth, kBoard, 15, kNoise, 4);
  ASSERT_EQ(scene.views.size(), 15U);
  for (std::size_t v = 0; v < 4; ++v) scene.views[v].corners[2].clear();
  const BoardCalibration c = calibrate_boards(scene.views, board_options(truth, kBoard));
  expect_recovered(c, truth, 3);
  EXPECT_EQ(c.cameras[0].images, 15);
  EXPECT_EQ(c.cameras[2].images, 11);
}

TEST(BoardCalibration, oneCameraAloneIsRecovered) {
  const RigCalibration truth = known_rig(1, CameraModelKind::pinhole_radtan);
  const BoardScene scene = board_scene(truth, kBoard, 12, kNoise, 5);
  const BoardCalibration c = calibrate_boards(scene.views, board_options(truth, kBoard));
  expect_recovered(c, truth, 3);
  EXPECT_NEAR(c.cameras[0].alone_rms_px, c.cameras[0].rms_px, 1e-6)
      << "OpenCV and the joint adjustment answer the same question";
}

TEST(BoardCalibration, sigmasHoldUpOverSeeds) {
  constexpr int kSeeds = 40;
  for (const auto kind : {CameraModelKind::pinhole_radtan, CameraModelKind::pinhole_equidistant}) {
    const RigCalibration truth = known_rig(2, kind);
    double wide = 0, noise = 0;
    for (std::uint64_t seed = 100; seed < 100 + kSeeds; ++seed) {
      const BoardScene scene = board_scene(truth, kBoard, 10, kNoise, seed);
      BoardProblem p{kBoard, scene.views, truth, scene.T_left_board};
      const BoardSolution s = solve_boards(&p, BoardParameters(2, 4));
      ASSERT_TRUE(s.converged);
      const Vec6 e = place_error(p.rig.T_camera_left[1], truth.T_camera_left[1]);
      const Mat6 covariance = s.covariance.bottomRightCorner<6, 6>();
      wide += e.dot(covariance.ldlt().solve(e)) / 6;
      const Mat6 held = s.places_given_lenses;
      noise += (held.diagonal().array() / covariance.diagonal().array()).maxCoeff();
    }
    // The mean of 40 · 6 squared normals has a sigma of √(2/240) = 0.09.
    EXPECT_NEAR(wide / kSeeds, 1, 0.27);
    EXPECT_LE(noise / kSeeds, 1) << "with the lenses held the places are known no worse";
  }
}

TEST(BoardCalibration, theJackknifeAgreesWithTheSigmasWhereNoiseIsAllThereIs) {
  const RigCalibration truth = known_rig(2, CameraModelKind::pinhole_radtan);
  const BoardScene scene = board_scene(truth, kBoard, 30, kNoise, 6);
  const BoardCalibration c = calibrate_boards(scene.views, board_options(truth, kBoard));
  ASSERT_EQ(c.error, "");
  for (std::size_t i = 0; i < 6;
       ++i) {  // 29 degrees of freedom: 13 % is one sigma, and the views differ in weight
    EXPECT_GT(c.between[1][i], 0.5 * c.rig.sigma_wide[1][i]) << i;
    EXPECT_LT(c.between[1][i], 2.0 * c.rig.sigma_wide[1][i]) << i;
  }
}

/// What corners of one view have in common is no noise: here every left image is stretched by some
/// amount of its own.
TEST(BoardCalibration, aLensIsKnownAsWellAsNoiseAndViewsSayInTheFileToo) {
  const RigCalibration truth = known_rig(2, CameraModelKind::pinhole_radtan);
  BoardScene scene = board_scene(truth, kBoard, 15, 0.02, 21);
  Random random(3, 1);
  for (BoardView& view : scene.views) {
    const Vec2 stretch = Vec2(1, 1) + 5e-4 * Vec2(random.normal(), random.normal());
    for (BoardCorner& corner : view.corners[0]) corner.pixel = corner.pixel.cwiseProduct(stretch);
  }
  const BoardCalibration c = calibrate_boards(scene.views, board_options(truth, kBoard));
  ASSERT_EQ(c.error, "");
  CalibrationFile file;
  file.rig = c.rig;
  const RigCalibration back = parse_calibration(format_calibration(file), "c.yaml").rig;
  for (std::size_t k = 0; k < 2; ++k) {
    const Intrinsics& lens = back.intrinsics[k];
    const BoardCameraResult& camera = c.cameras[k];
    for (std::size_t i = 0; i < 8; ++i) {
      const double sigma = i < 4 ? lens.sigma[i] : lens.distortion_sigma[i - 4];
      EXPECT_GT(camera.noise[i], 0);
      EXPECT_NEAR(sigma / std::max(camera.noise[i], camera.between[i]), 1, 1e-6) << k << " " << i;
    }
    EXPECT_EQ(lens.distortion_sigma[4], 0) << "k3 is not estimated";
  }
  EXPECT_GT(c.cameras[0].between[0], 1.2 * c.cameras[0].noise[0]) << "nothing is tested";
}

TEST(BoardCalibration, theJackknifeIsWhatLeavingOutViewsDoes) {
  const RigCalibration truth = known_rig(2, CameraModelKind::pinhole_radtan);
  const BoardScene scene = board_scene(truth, kBoard, 12, kNoise, 8);
  BoardProblem all{kBoard, scene.views, truth, scene.T_left_board};
  const BoardSolution s = solve_boards(&all, BoardParameters(2, 4));
  ASSERT_TRUE(s.converged);
  for (std::size_t v = 0; v < 12; v += 5) {
    BoardProblem rest = all;
    rest.views.erase(rest.views.begin() + static_cast<std::ptrdiff_t>(v));
    rest.T_left_board.erase(rest.T_left_board.begin() + static_cast<std::ptrdiff_t>(v));
    ASSERT_TRUE(solve_boards(&rest, BoardParameters(2, 4)).converged);
    const Vec6 moved = place_error(rest.rig.T_camera_left[1], all.rig.T_camera_left[1]);
    const Vec6 told = s.without.row(static_cast<Eigen::Index>(v)).tail<6>().transpose();
    for (int i = 0; i < 6; ++i)
      EXPECT_NEAR(told(i), moved(i), 0.1 * std::sqrt(s.covariance(16 + i, 16 + i)))
          << "view " << v << " number " << i;
  }
}

TEST(BoardCalibration, aPairOfImagesThatDoNotBelongTogetherIsRefusedAndNothingElse) {
  const RigCalibration truth = known_rig(2, CameraModelKind::pinhole_radtan);
  BoardScene scene = board_scene(truth, kBoard, 14, kNoise, 9);
  std::swap(scene.views[4].corners[1], scene.views[5].corners[1]);
  const BoardCalibration c = calibrate_boards(scene.views, board_options(truth, kBoard));
  expect_recovered(c, truth, 4);
  for (std::size_t v = 0; v < 14; ++v) EXPECT_EQ(c.views[v].used, v != 4 && v != 5) << v;
  EXPECT_GT(c.views[4].rms_px, 5);
}

TEST(BoardCalibration, aBoardThatMovedBetweenTheExposuresIsRefused) {
  const RigCalibration truth = known_rig(2, CameraModelKind::pinhole_radtan);
  BoardScene scene = board_scene(truth, kBoard, 14, kNoise, 10);
  for (BoardCorner& corner : scene.views[7].corners[1])
    corner.pixel.y() += 2.5;  // px: half of it goes into the board's pose
  const BoardCalibration c = calibrate_boards(scene.views, board_options(truth, kBoard));
  expect_recovered(c, truth, 4);
  EXPECT_FALSE(c.views[7].used);
  EXPECT_EQ(c.rig.frames, 13);
}

TEST(BoardCalibration, exchangedCamerasAreNoRig) {
  const RigCalibration truth = known_rig(2, CameraModelKind::pinhole_radtan);
  BoardScene scene = board_scene(truth, kBoard, 10, kNoise, 11);
  for (BoardView& v : scene.views) std::swap(v.corners[0], v.corners[1]);
  const BoardCalibration c = calibrate_boards(scene.views, board_options(truth, kBoard));
  EXPECT_NE(c.error.find("left and right are swapped"), std::string::npos) << c.error;
}

TEST(BoardCalibration, viewsThatDetermineNothingAreSaidToBeThat) {
  const RigCalibration truth = known_rig(2, CameraModelKind::pinhole_radtan);
  BoardScene scene = board_scene(truth, kBoard, 3, kNoise, 12);
  scene.views.pop_back();
  EXPECT_THROW((void)calibrate_boards(scene.views, board_options(truth, kBoard)), InputError);
  scene.views.assign(
      6, scene.views.front());  // one board pose six times: its focal length is anybody's guess
  const BoardCalibration c = calibrate_boards(scene.views, board_options(truth, kBoard));
  if (c.error.empty()) {
    EXPECT_GT(c.rig.intrinsics[0].sigma[0], 1) << "px: not known, and said so";
  }
}

TEST(BoardPattern, onlyBoardsThatCanBeToldArePermitted) {
  EXPECT_EQ(parse_checkerboard("9x6", 0.1).corners(), 54U);
  for (const char* bad :
       {"", "9", "9x", "x6", "9x6x", "9 x 6", "2x6", "-9x6", "1000x6", "6x6", "9X6"})
    EXPECT_THROW((void)parse_checkerboard(bad, 0.1), InputError) << bad;
  for (const double bad : {0.0, -0.1, 25.0, std::nan("")})
    EXPECT_THROW((void)parse_checkerboard("9x6", bad), InputError) << bad;
  EXPECT_TRUE(parse_checkerboard("9x6", 0.1).tells_its_ends());
  EXPECT_FALSE(parse_checkerboard("8x6", 0.1).tells_its_ends());
}

}  // namespace
}  // namespace vergence::app
