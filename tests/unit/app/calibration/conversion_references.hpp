#pragma once
#include <gtest/gtest.h>

#include <array>
#include <string>
#include <vector>

#include <yaml-cpp/yaml.h>
#include <opencv2/calib3d.hpp>

#include "app/calibration/conversion.hpp"
#include "core/camera/camera.hpp"
#include "tests/unit/app/calibration/board_scene.hpp"

/// What the tests of other programs' formats compare with: OpenCV's own projection.
namespace vergence::test {

using app::CalibrationFile;

inline constexpr double kSamePixel = 1e-9;

/// What a format's file says, in OpenCV's terms: X_camera = R X_left + t.
struct Reference {
  cv::Mat K, D, R, t;
  bool fisheye = false;
};

inline Vec2 project(const Reference& r, const Vec3& X_left) {
  const cv::Mat in_camera =
      r.R * (cv::Mat_<double>(3, 1) << X_left.x(), X_left.y(), X_left.z()) + r.t;
  const std::vector<cv::Point3d> X{
      {in_camera.at<double>(0), in_camera.at<double>(1), in_camera.at<double>(2)}};
  const cv::Mat none = cv::Mat::zeros(3, 1, CV_64F);
  std::vector<cv::Point2d> x;
  if (r.fisheye)
    cv::fisheye::projectPoints(X, x, none, none, r.K, r.D);
  else
    cv::projectPoints(X, none, none, r.K, r.D, x);
  return {x[0].x, x[0].y};
}

inline std::vector<Vec3> points() {
  Random random(31);
  std::vector<Vec3> points;
  for (int i = 0; i < 200; ++i) {
    const double z = random.uniform(0.5, 20);
    points.emplace_back(z * random.uniform(-0.45, 0.45), z * random.uniform(-0.35, 0.35), z);
  }
  return points;
}

/// Both project every point to the same pixel in every camera.
inline void expect_same(const CalibrationFile& ours, const std::vector<Reference>& theirs) {
  ASSERT_EQ(static_cast<std::size_t>(ours.rig.cameras), theirs.size());
  for (std::size_t k = 0; k < theirs.size(); ++k) {
    const Camera camera(ours.rig.intrinsics[k]);
    double worst = 0;
    for (const Vec3& X : points()) {
      Vec2 x;
      ASSERT_EQ(camera.project(ours.rig.T_camera_left[k] * X, &x, nullptr), ProjectStatus::ok);
      worst = std::max(worst, (x - project(theirs[k], X)).norm());
    }
    EXPECT_LT(worst, kSamePixel) << "camera " << k;
  }
}

inline void expect_same(const CalibrationFile& a, const CalibrationFile& b) {
  ASSERT_EQ(a.rig.cameras, b.rig.cameras);
  for (std::size_t k = 0; k < static_cast<std::size_t>(a.rig.cameras); ++k) {
    EXPECT_EQ(a.rig.intrinsics[k].width, b.rig.intrinsics[k].width);
    EXPECT_EQ(a.rig.intrinsics[k].height, b.rig.intrinsics[k].height);
    EXPECT_EQ(a.rig.intrinsics[k].kind, b.rig.intrinsics[k].kind);
    const Camera one(a.rig.intrinsics[k]), other(b.rig.intrinsics[k]);
    for (const Vec3& X : points()) {
      Vec2 x, y;
      ASSERT_EQ(one.project(a.rig.T_camera_left[k] * X, &x, nullptr), ProjectStatus::ok);
      ASSERT_EQ(other.project(b.rig.T_camera_left[k] * X, &y, nullptr), ProjectStatus::ok);
      ASSERT_LT((x - y).norm(), kSamePixel) << "camera " << k;
    }
  }
}

inline CalibrationFile ours(CameraModelKind kind, int cameras = 2) {
  CalibrationFile c;
  c.rig = known_rig(cameras, kind);
  for (std::size_t k = 1; k < static_cast<std::size_t>(cameras); ++k)
    c.rig.T_camera_left[k].R =
        normalised(exp_so3(Vec3(0.02, -0.05, 0.013)) * c.rig.T_camera_left[k].R);
  c.names = {"port", "starboard", "bow", "stern"};
  c.serials[0] = "4711";
  return c;
}

inline constexpr std::array kModels{CameraModelKind::pinhole_radtan,
                                    CameraModelKind::pinhole_equidistant};

inline cv::Mat diagonal(double fx, double fy, double cx, double cy) {
  return (cv::Mat_<double>(3, 3) << fx, 0, cx, 0, fy, cy, 0, 0, 1);
}

inline cv::Mat matrix(const YAML::Node& list, int rows, int columns) {
  cv::Mat m(rows, columns, CV_64F);
  for (int i = 0; i < rows * columns; ++i)
    m.at<double>(i / columns, i % columns) = list[static_cast<std::size_t>(i)].as<double>();
  return m;
}

inline std::string replaced(std::string text, const std::string& what, const std::string& by) {
  const auto at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return at == std::string::npos ? text : text.replace(at, what.size(), by);
}

/// As Kalibr writes it; EuRoC's cameras.
inline const std::string kCamchain = R"(cam0:
  T_cam_imu:
  - [0.0148, -0.9998, 0.0041, -0.0216]
  - [0.9995, 0.0149, 0.0257, -0.0646]
  - [-0.0257, 0.0037, 0.9996, 0.0098]
  - [0.0, 0.0, 0.0, 1.0]
  cam_overlaps: [1]
  camera_model: pinhole
  distortion_coeffs: [-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05]
  distortion_model: radtan
  intrinsics: [458.654, 457.296, 367.215, 248.375]
  resolution: [752, 480]
  rostopic: /left/image_raw
  timeshift_cam_imu: -8.1e-05
cam1:
  T_cn_cnm1:
  - [0.9999972564, 0.0023173770, 0.0003439280, -0.1100738084]
  - [-0.0023123537, 0.9998980481, -0.0140903132, 0.0003991215]
  - [-0.0003765449, 0.0140894793, 0.9999006674, -0.0008537025]
  - [0.0, 0.0, 0.0, 1.0]
  camera_model: pinhole
  distortion_coeffs: [-0.28368365, 0.07451284, -0.00010473, -3.55590700e-05]
  distortion_model: radtan
  intrinsics: [457.587, 456.134, 379.999, 255.238]
  resolution: [752, 480]
  rostopic: /cam1/image_raw
)";

}  // namespace vergence::test
