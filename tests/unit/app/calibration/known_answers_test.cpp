// Thirteen pairs of a chessboard whose calibration by OpenCV is known
// (checkerboards/opencv/README.md of the shared data).
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <fstream>
#include <map>
#include <string>

#include "app/calibration/board_calibration.hpp"
#include "app/calibration/board_images.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/unit/app/calibration/board_scene.hpp"

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

/// view, camera, row, col, u, v.
std::vector<BoardView> listed_corners(const fs::path& folder) {
  std::ifstream in(folder / "corners.csv");
  std::map<int, BoardView> views;
  std::string line;
  std::getline(in, line);
  while (std::getline(in, line)) {
    int view = 0, row = 0, col = 0;
    char camera[16] = {};
    double u = 0, v = 0;
    if (std::sscanf(line.c_str(), "%d,%15[^,],%d,%d,%lf,%lf", &view, camera, &row, &col, &u, &v) !=
        6)
      continue;
    BoardView& seen = views[view];
    seen.name = std::to_string(view);
    auto& corners = seen.corners[std::string(camera) == "left" ? 0 : 1];
    corners.resize(54);
    const auto at = static_cast<std::size_t>(row * 9 + col);
    corners[at] = {at, {u, v}};
  }
  std::vector<BoardView> list;
  for (const auto& [number, view] : views) list.push_back(view);
  return list;
}

TEST(KnownAnswers, ListedCornersGiveTheListedCalibration) {
  const auto folder = test::shared_data(kFolder);
  if (!folder) GTEST_SKIP() << test::shared_data_missing(kFolder);
  const auto views = listed_corners(*folder);
  ASSERT_EQ(views.size(), 13U);
  const BoardCalibration c = calibrate_boards(views, options());
  ASSERT_EQ(c.error, "");
  // The listed figures end where they end; the corners have five digits or so behind the point.
  const Intrinsics &left = c.rig.intrinsics[0], &right = c.rig.intrinsics[1];
  const std::array found{left.fx,  left.fy,  left.cx,  left.cy,
                         right.fx, right.fy, right.cx, right.cy};
  const std::array listed{533.5633, 533.5966, 342.5343, 234.7651,
                          536.8943, 536.4753, 327.3958, 249.9484};
  for (std::size_t i = 0; i < found.size(); ++i) EXPECT_NEAR(found[i], listed[i], 0.02) << i;
  const std::array listed_left{-0.28866, 0.09360, 0.001203, -0.000144},
      listed_right{-0.29009, 0.10620, -0.000509, 0.000105};
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_NEAR(left.distortion[i], listed_left[i], 1e-4) << i;
    EXPECT_NEAR(right.distortion[i], listed_right[i], 1e-4) << i;
  }
  EXPECT_NEAR(c.rig.reprojection_px, 0.2153, 1e-4);
  EXPECT_NEAR(c.cameras[0].alone_rms_px, 0.1957, 1e-4);
  EXPECT_NEAR(c.cameras[1].alone_rms_px, 0.2077, 1e-4);
  const Vec3 t = 1e3 * c.rig.T_camera_left[1].t, r = log_so3(c.rig.T_camera_left[1].R) / kDegree;
  EXPECT_LT((t - Vec3(-83.178, 0.918, -0.119)).norm(), 0.005) << t.transpose();
  EXPECT_LT((r - Vec3(0.4102, 0.2449, -0.2010)).norm(), 0.001) << r.transpose();
  for (const BoardViewResult& v : c.views) EXPECT_TRUE(v.used) << v.name;
  // The listed jackknife is over single views, this one over pairs of them.
  const std::array listed_deg{0.11, 0.09, 0.01}, listed_mm{0.12, 0.04, 0.35};
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(c.rig.sigma_wide[1][i] / kDegree / listed_deg[i], 1, 0.5) << i;
    EXPECT_NEAR(1e3 * c.rig.sigma_wide[1][3 + i] / listed_mm[i], 1, 0.5) << i;
  }
}

TEST(KnownAnswers, ImagesGiveTheSameCalibration) {
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
