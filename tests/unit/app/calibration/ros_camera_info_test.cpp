#include "app/calibration/conversion.hpp"

#include <gtest/gtest.h>

#include "app/runtime/errors.hpp"
#include "tests/unit/app/calibration/conversion_references.hpp"

namespace vergence::app {
namespace {

using namespace test;

struct Info {
  cv::Mat K, D, R, P;
  bool fisheye = false;
};

Info info_of(const std::string& text) {
  const YAML::Node root = YAML::Load(text);
  const int d = root["distortion_coefficients"]["cols"].as<int>();
  return {matrix(root["camera_matrix"]["data"], 3, 3),
          matrix(root["distortion_coefficients"]["data"], 1, d),
          matrix(root["rectification_matrix"]["data"], 3, 3),
          matrix(root["projection_matrix"]["data"], 3, 4),
          root["distortion_model"].as<std::string>() == "equidistant"};
}

/// By the definition of sensor_msgs/CameraInfo: a point X of the rectified left camera has the
/// pixel P (X, 1) in each rectified image, and lies at R⁻¹ K'⁻¹ (pixel, 1) · depth in the camera
/// itself, where K and D make the raw image of it.
void expect_camera_info(const CalibrationFile& c, const Info& l, const Info& r) {
  for (const Vec3& X_left : points()) {
    const cv::Mat X = (cv::Mat_<double>(3, 1) << X_left.x(), X_left.y(), X_left.z());
    cv::Mat rectified(4, 1, CV_64F, 1.0);
    rectified.rowRange(0, 3) = l.R * X;
    const cv::Mat pixel = r.P * rectified;
    const cv::Mat X_right =
        r.R.t() * r.P.colRange(0, 3).inv() * pixel;  // homogeneous pixel keeps its depth
    const Reference in_left{l.K, l.D, cv::Mat::eye(3, 3, CV_64F), cv::Mat::zeros(3, 1, CV_64F),
                            l.fisheye};
    const Reference in_right{r.K, r.D, cv::Mat::eye(3, 3, CV_64F), cv::Mat::zeros(3, 1, CV_64F),
                             r.fisheye};
    Vec2 x_left, x_right;
    ASSERT_EQ(Camera(c.rig.intrinsics[0]).project(X_left, &x_left, nullptr), ProjectStatus::ok);
    ASSERT_EQ(
        Camera(c.rig.intrinsics[1]).project(c.rig.T_camera_left[1] * X_left, &x_right, nullptr),
        ProjectStatus::ok);
    ASSERT_LT((x_left - project(in_left, X_left)).norm(), kSamePixel);
    ASSERT_LT((x_right - project(in_right, {X_right.at<double>(0), X_right.at<double>(1),
                                            X_right.at<double>(2)}))
                  .norm(),
              kSamePixel);
    // Rectified rows are the same in both images: what camera_info is for.
    const cv::Mat left_pixel = l.P * rectified;
    ASSERT_NEAR(left_pixel.at<double>(1) / left_pixel.at<double>(2),
                pixel.at<double>(1) / pixel.at<double>(2), 1e-8);
  }
}

TEST(RosCameraInfo, whatIsWrittenProjectsAsOursAndReadsBack) {
  for (const auto kind : kModels) {
    CalibrationFile c = ours(kind);
    if (kind == CameraModelKind::pinhole_radtan)
      c.rig.intrinsics[0].distortion[4] = -0.004;  // k3 has its place here
    Remarks remarks;
    const auto [left, right] = format_ros(c, &remarks);
    expect_camera_info(c, info_of(left), info_of(right));
    EXPECT_LT(info_of(right).P.at<double>(0, 3), 0) << "−fx B of a camera on the right";
    const CalibrationFile back =
        parse_any_calibration({{"left.yaml", left}, {"right.yaml", right}}, std::nullopt, &remarks);
    expect_same(c, back);
    EXPECT_EQ(back.names[0], "port");
  }
}

}  // namespace
}  // namespace vergence::app
