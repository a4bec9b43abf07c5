// Real stereo detections of a grid of tags, some of them wrong, with a published stereo transform
// (data/euroc_aprilgrid beside the project).
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <optional>
#include <tuple>

#include <gtest/gtest.h>

#include <Eigen/SVD>

#include "tests/unit/core/bundle/bundle_fixture.hpp"

namespace vergence {
namespace {

constexpr std::size_t kCorners = 144;
constexpr int kEvery = 10;

std::filesystem::path folder() {
  const char* shared = std::getenv("VERGENCE_SHARED");
  return std::filesystem::path(shared != nullptr ? shared : VERGENCE_SOURCE_DIR "/../shared") /
         "data" / "euroc_aprilgrid";
}

Camera euroc(double fx, double fy, double cx, double cy, const std::array<double, 4>& d) {
  Intrinsics k;
  k.width = 752;
  k.height = 480;
  k.fx = fx;
  k.fy = fy;
  k.cx = cx;
  k.cy = cy;
  k.distortion = {d[0], d[1], d[2], d[3], 0};
  return Camera(k);
}

struct Corner {
  int frame, camera;
  std::uint32_t id;
  Vec2 pixel;
};

std::vector<Corner> read_corners(const std::filesystem::path& file) {
  const std::unique_ptr<gzFile_s, int (*)(gzFile)> in(gzopen(file.c_str(), "rb"), gzclose);
  std::vector<Corner> corners;
  std::array<char, 128> line{};
  while (in != nullptr && gzgets(in.get(), line.data(), static_cast<int>(line.size())) != nullptr) {
    Corner c{};
    if (std::sscanf(line.data(), "%d,%d,%u,%lf,%lf", &c.frame, &c.camera, &c.id, &c.pixel.x(),
                    &c.pixel.y()) == 5 &&
        c.id < kCorners)
      corners.push_back(c);
  }
  return corners;
}

std::vector<Vec3> read_grid(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::vector<Vec3> grid(kCorners, Vec3::Zero());
  for (std::string line; std::getline(in, line);) {
    unsigned id = 0;
    Vec3 p;
    if (std::sscanf(line.c_str(), "%u,%*d,%*d,%lf,%lf,%lf", &id, &p.x(), &p.y(), &p.z()) == 4 &&
        id < kCorners)
      grid[id] = p;
  }
  return grid;
}

/// Board to camera from the homography of a flat board: linear, good to a degree or so, which is
/// what a start needs.
std::optional<Transform> board_pose(const Camera& camera, const std::vector<Corner>& corners,
                                    const std::vector<Vec3>& grid) {
  if (corners.size() < 12) return std::nullopt;
  Eigen::MatrixXd A(2 * static_cast<Eigen::Index>(corners.size()), 9);
  Eigen::Index row = 0;
  for (const Corner& c : corners) {
    Vec3 ray;
    if (!camera.unproject(c.pixel, &ray)) return std::nullopt;
    const Vec3 X(grid[c.id].x(), grid[c.id].y(), 1);
    A.row(row++) << X.transpose(), 0, 0, 0, -ray.x() * X.transpose();
    A.row(row++) << 0, 0, 0, X.transpose(), -ray.y() * X.transpose();
  }
  const Eigen::Matrix<double, 9, 1> h =
      Eigen::JacobiSVD<Eigen::MatrixXd>(A, Eigen::ComputeThinV).matrixV().col(8);
  Mat3 H = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(h.data());
  H /= std::sqrt(H.col(0).norm() * H.col(1).norm());
  if (H(2, 2) < 0) H = -H;  // the board is in front
  Mat3 R;
  R << H.col(0), H.col(1), H.col(0).cross(H.col(1));
  const Eigen::JacobiSVD<Mat3> svd(R, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return Transform{svd.matrixU() * svd.matrixV().transpose(), H.col(2)};
}

TEST(AprilGrid, publishedStereoTransformIsFoundFromFiveDegreesAndAFifthOfTheBaselineOff) {
  if (!std::filesystem::exists(folder() / "corners.csv.gz"))
    GTEST_SKIP() << "no " << folder()
                 << "; set VERGENCE_SHARED to the folder that holds data/euroc_aprilgrid";
  const std::vector<Vec3> grid = read_grid(folder() / "grid.csv");
  const std::vector<Corner> corners = read_corners(folder() / "corners.csv.gz");
  ASSERT_EQ(corners.size(), 358288U);

  SimulatedRig rig;  // used as a bag of arrays
  rig.cameras = {euroc(458.654, 457.296, 367.215, 248.375,
                       {-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05}),
                 euroc(457.587, 456.134, 379.999, 255.238,
                       {-0.28368365, 0.07451284, -0.00010473, -3.55590700e-05})};
  Mat3 R;
  R << 0.999997256, 0.002312067, 0.000376008, -0.002317136, 0.999898049, 0.014089836, -0.000343393,
      -0.014090668, 0.999900663;
  const Transform published{normalised(R), {-0.110073808, 0.000399122, -0.000853703}};
  const Vec3 axis = Vec3(0.4, -0.7, 0.6).normalized();
  const double length = published.t.norm();
  rig.T_camera_left = {Transform{},
                       {exp_so3(axis * (5.0 * M_PI / 180)) * published.R,
                        (published.t + 0.2 * length * Vec3(0, 0.8, -0.6)).normalized() * length}};
  rig.points = grid;

  std::map<int, std::array<std::vector<Corner>, 2>> frames;
  for (const Corner& c : corners)
    if (c.frame % kEvery == 0) frames[c.frame][static_cast<std::size_t>(c.camera)].push_back(c);
  for (const auto& [frame, seen] : frames) {
    const std::optional<Transform> T = board_pose(rig.cameras[0], seen[0], grid);
    if (!T) continue;
    const auto pose = static_cast<std::uint16_t>(rig.T_left_world.size());
    rig.T_left_world.push_back(*T);
    for (const auto& camera : seen)
      for (const Corner& c : camera)
        rig.observations.push_back(
            {c.id, pose, static_cast<std::uint8_t>(c.camera), 1.0F, c.pixel.x(), c.pixel.y()});
  }
  EXPECT_GE(rig.T_left_world.size(), 140U);
  std::sort(rig.observations.begin(), rig.observations.end(),
            [](const BundleObservation& a, const BundleObservation& b) {
              return std::tie(a.point, a.pose, a.camera) < std::tie(b.point, b.pose, b.camera);
            });

  BundleCapacities c;
  c.poses = rig.T_left_world.size();
  c.points = kCorners;
  c.observations = rig.observations.size();
  OwnAdjuster own(c);
  BundleOptions o = calibration_options();
  o.length[1].metres = length;
  o.loss = BundleLoss::cauchy;
  o.loss_threshold = 1.0;  // px: inverse_sigma is 1
  o.max_steps = 60;
  o.covariance = true;
  const BundleResult r = own.adjuster.solve(rig.problem(), o);
  ASSERT_TRUE(r.converged()) << to_string(r.termination) << " after " << r.steps << " steps, "
                             << to_string(r.defect) << " " << r.defect_index;
  const Transform& found = rig.T_camera_left[1];
  Vec6 e;
  e << log_so3(found.R * published.R.transpose()), found.t - published.t;
  const double rotation_deg = e.head<3>().norm() * 180 / M_PI,
               translation_mm = e.tail<3>().norm() * 1e3;
  RecordProperty("steps", r.steps);
  std::printf(
      "%zu poses, %d steps, rms %.3f px: rotation off by %.4f deg, translation by %.3f mm\n",
      rig.T_left_world.size(), r.steps, r.rms_px, rotation_deg, translation_mm);
  EXPECT_LT(rotation_deg, 0.035);
  EXPECT_LT(translation_mm, 0.4);
  ASSERT_TRUE(r.has_covariance);
  for (int i = 0; i < 6; ++i) {
    const double sigma = std::sqrt(r.covariance_wide[1](i, i));
    EXPECT_LT(std::abs(e[i]), 2 * sigma) << "component " << i;
    EXPECT_LT(sigma, i < 3 ? 2e-3 : 5e-3) << "a sigma that covers everything says nothing";
  }
}

}  // namespace
}  // namespace vergence
