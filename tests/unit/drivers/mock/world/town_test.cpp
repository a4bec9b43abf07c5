// The rendered suburb measured against the geometry it was rendered from.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <vector>

#include <Eigen/LU>
#include <opencv2/imgproc.hpp>

#include "drivers/mock/world/drive.hpp"
#include "drivers/mock/world/renderer.hpp"

namespace vergence::mock {
namespace {

std::shared_ptr<const World> town() {
  static const auto world = std::make_shared<const World>(WorldOptions{});
  return world;
}

Camera lens() {
  Intrinsics k;
  k.width = 640;
  k.height = 480;
  k.fx = k.fy = 554;
  k.cx = 321;
  k.cy = 238;
  k.distortion = {-0.2, 0.06, 0.0003, -0.0005, 0};
  return Camera(k);
}

cv::Mat take(Renderer* renderer, const Transform& T_camera_enu) {
  cv::Mat image(480, 640, CV_8UC1);
  renderer->render(T_camera_enu, Shot{.vignetting = 0}, image.data,
                   static_cast<std::ptrdiff_t>(image.step));
  return image;
}

Transform view(double seconds) {
  static const Drive drive(DriveOptions{}, *town());
  return camera_pose(drive.at(Duration::seconds(seconds)), default_T_body_left());
}

TEST(Town, hasNearAndFarStructureAllAlongTheLoop) {
  const Drive drive(DriveOptions{}, *town());
  for (double seconds = 0; seconds < drive.duration().to_seconds(); seconds += 9) {
    const Transform T_camera_enu = view(seconds), T_enu_camera = T_camera_enu.inverse();
    Renderer renderer(town(), lens());
    const cv::Mat image = take(&renderer, T_camera_enu);
    std::vector<cv::Point2f> corners;
    cv::goodFeaturesToTrack(image, corners, 500, 0.01, 8);
    int near = 0, far = 0;
    for (const cv::Point2f& c : corners) {
      Vec3 ray;
      ASSERT_TRUE(lens().unproject({static_cast<double>(c.x), static_cast<double>(c.y)}, &ray));
      const auto depth = town()->cast(T_enu_camera.t, T_enu_camera.R * ray);
      if (!depth) continue;
      near += depth->distance < 15;
      far += depth->distance > 40;
    }
    EXPECT_GT(corners.size(), 150U) << seconds;
    EXPECT_GT(near, 20) << seconds;
    EXPECT_GT(far, 20) << seconds;
    const double brightness = cv::mean(image)[0];
    EXPECT_GT(brightness, 70) << seconds;
    EXPECT_LT(brightness, 170) << seconds;
  }
}

TEST(Town, aBusThatFillsTheViewHidesTheTownAndIsTexturedItself) {
  Renderer renderer(town(), lens());
  // Its rear 1.2 m ahead: 92 by 106 degrees, the picture is 60 by 47.
  Transform T_camera_bus = view(20) * view(20).inverse();
  T_camera_bus.R << 0, -1, 0, 0, 0, -1, 1, 0, 0;  // its forward, left, up in the camera's axes
  T_camera_bus.t = {0, 1.7, 1.2 + 0.5 * kBusLength};
  const auto take_behind = [&](const Transform& T_camera_enu) {
    cv::Mat image(480, 640, CV_8UC1);
    renderer.render(std::span(&T_camera_enu, 1), Shot{.vignetting = 0}, image.data,
                    static_cast<std::ptrdiff_t>(image.step), std::span(&T_camera_bus, 1));
    return image;
  };
  const cv::Mat here = take_behind(view(20)), there = take_behind(view(45));
  EXPECT_EQ(cv::norm(here, there, cv::NORM_INF), 0) << "something of the town is seen";
  cv::Scalar mean, deviation;
  cv::meanStdDev(here, mean, deviation);
  EXPECT_GT(deviation[0], 15) << "there are edges to be seen on it";
}

}  // namespace
}  // namespace vergence::mock
