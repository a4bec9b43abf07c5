// Thirteen pairs of a chessboard whose calibration by OpenCV is known
// (checkerboards/opencv/README.md of the shared data).
#include <gtest/gtest.h>

#include "app/checkerboard/board_images.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/unit/app/checkerboard/board_scene.hpp"

namespace vergence::app {
namespace {

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
