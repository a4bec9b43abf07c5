#include "core/camera/camera.hpp"

#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <opencv2/calib3d.hpp>
#include <vector>

#include "tests/support/numeric_jacobian.hpp"

namespace vergence {
namespace {

struct Model {
  const char* name;
  Intrinsics k;
  // Largest angle from the axis, in rad, at which this lens is tested.
  double widest;
};

Intrinsics intrinsics(CameraModelKind kind, int width, int height, const std::array<double, 4>& k,
                      const std::array<double, 5>& d) {
  return {kind, width, height, k[0], k[1], k[2], k[3], d};
}

/// Real lenses of both kinds and one without distortion.
std::array<Model, 4> models() {
  using enum CameraModelKind;
  return {
      {{"plain",
        intrinsics(pinhole_radtan, 1226, 370, {707.0912, 707.0912, 601.8873, 183.1104}, {}), 0.8},
       {"radtan",
        intrinsics(pinhole_radtan, 752, 480, {458.654, 457.296, 367.215, 248.375},
                   {-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05, 0}),
        0.75},
       {"radtan with k3",
        intrinsics(pinhole_radtan, 1024, 768, {700, 702, 510, 380},
                   {0.12, -0.21, -1.1e-3, 2.3e-3, 0.08}),
        0.75},
       {"equidistant",
        intrinsics(pinhole_equidistant, 512, 512,
                   {190.97847715, 190.97330720, 254.93170605, 256.89744287},
                   {3.48238940e-3, 7.15034845e-4, -2.05323614e-3, 2.02936735e-4, 0}),
        1.25}}};
}

/// Points from the axis to the lens's edge, all round, near and far.
std::vector<Vec3> points(const Model& model) {
  std::vector<Vec3> all;
  for (const double depth : {0.5, 4.0, 1000.0})
    for (const double share : {0.0, 1e-10, 1e-6, 0.1, 0.5, 0.9, 1.0})
      for (int i = 0; i < 8; ++i) {
        const double around = i * std::numbers::pi / 4 + 0.1,
                     radius = depth * std::tan(share * model.widest);
        all.emplace_back(radius * std::cos(around), radius * std::sin(around), depth);
      }
  return all;
}

TEST(Camera, projectionMatchesOpenCv) {
  for (const Model& model : models()) {
    const Camera camera(model.k);
    const cv::Matx33d K(model.k.fx, 0, model.k.cx, 0, model.k.fy, model.k.cy, 0, 0, 1);
    for (const Vec3& p : points(model)) {
      Vec2 pixel;
      ASSERT_EQ(camera.project(p, &pixel, nullptr), ProjectStatus::ok)
          << model.name << " " << p.transpose();
      const std::vector<cv::Point3d> point = {{p.x(), p.y(), p.z()}};
      std::vector<cv::Point2d> expected;
      const auto& d = model.k.distortion;
      if (model.k.kind == CameraModelKind::pinhole_equidistant)
        cv::fisheye::projectPoints(point, expected, cv::Vec3d(), cv::Vec3d(), K,
                                   cv::Vec4d(d[0], d[1], d[2], d[3]));
      else
        cv::projectPoints(point, cv::Vec3d(), cv::Vec3d(), K,
                          cv::Mat(1, 5, CV_64F, const_cast<double*>(d.data())), expected);
      // OpenCV leaves the equidistant factor at 1 below r = 1e-8, which is exact to better than
      // this.
      EXPECT_NEAR(pixel.x(), expected[0].x, 1e-9) << model.name << " " << p.transpose();
      EXPECT_NEAR(pixel.y(), expected[0].y, 1e-9) << model.name << " " << p.transpose();
    }
  }
}

TEST(Camera, jacobianMatchesCentralDifferences) {
  for (const Model& model : models()) {
    const Camera camera(model.k);
    for (const Vec3& p : points(model)) {
      Vec2 pixel;
      Mat23 J;
      ASSERT_EQ(camera.project(p, &pixel, &J), ProjectStatus::ok);
      const auto at = [&](const Vec3& d) {
        Vec2 x(0, 0);
        EXPECT_EQ(camera.project(p + d, &x, nullptr), ProjectStatus::ok);
        return x;
      };
      // Steps in proportion to the depth: pixels of order 1000 carry 1e-13, so the difference
      // quotient carries 1e-7/depth.
      EXPECT_TRUE(test::jacobian_matches(J, at, 1e-6, 1e-6 * p.z()))
          << model.name << " at " << p.transpose();
    }
  }
}

TEST(Camera, intrinsicsJacobianMatchesCentralDifferences) {
  using Parameters = Eigen::Matrix<double, 9, 1>;
  for (const Model& model : models()) {
    for (const Vec3& p : points(model)) {
      const auto at = [&](const Parameters& d) {
        Intrinsics k = model.k;
        k.fx += d[0];
        k.fy += d[1];
        k.cx += d[2];
        k.cy += d[3];
        for (std::size_t i = 0; i < 5; ++i) k.distortion[i] += d[static_cast<Eigen::Index>(i) + 4];
        Vec2 x(0, 0);
        EXPECT_EQ(Camera(k).project(p, &x, nullptr), ProjectStatus::ok);
        return x;
      };
      EXPECT_TRUE(test::jacobian_matches(Camera(model.k).intrinsics_jacobian(p), at, 1e-6))
          << model.name << " at " << p.transpose();
    }
  }
}

TEST(Camera, unprojectInvertsProject) {
  for (const Model& model : models()) {
    const Camera camera(model.k);
    for (const Vec3& p : points(model)) {
      Vec2 pixel;
      ASSERT_EQ(camera.project(p, &pixel, nullptr), ProjectStatus::ok);
      Vec3 ray;
      ASSERT_TRUE(camera.unproject(pixel, &ray)) << model.name << " " << p.transpose();
      EXPECT_EQ(ray.z(), 1.0);
      Vec2 again;
      ASSERT_EQ(camera.project(ray, &again, nullptr), ProjectStatus::ok);
      EXPECT_LT((again - pixel).norm(), 1e-8) << model.name << " " << p.transpose();
      // The slope of the distorted radius is at least 1/20 inside the range: pixels carry rays to
      // 20 times their error.
      EXPECT_LT((ray - p / p.z()).norm(), 2e-10 * (1 + (p / p.z()).squaredNorm()))
          << model.name << " " << p.transpose();
    }
  }
}

TEST(Camera, everyPixelOfARadtanLensHasARay) {
  for (const Model& model : models()) {
    if (model.k.kind != CameraModelKind::pinhole_radtan) continue;
    const Camera camera(model.k);
    for (int y = 0; y < model.k.height; y += 37)
      for (int x = 0; x < model.k.width; x += 41) {
        Vec3 ray;
        ASSERT_TRUE(camera.unproject({x, y}, &ray)) << model.name << " " << x << " " << y;
        Vec2 again;
        ASSERT_EQ(camera.project(ray, &again, nullptr), ProjectStatus::ok);
        EXPECT_LT((again - Vec2(x, y)).norm(), 1e-8) << model.name;
      }
  }
}

TEST(Camera, unprojectRefusesUnreachablePixels) {
  const Camera fisheye(models()[3].k);
  Vec3 ray(7, 7, 7);
  EXPECT_FALSE(fisheye.unproject({0, 0}, &ray)) << "the corner looks backwards";
  EXPECT_FALSE(fisheye.unproject({std::numeric_limits<double>::quiet_NaN(), 3}, &ray));
  EXPECT_FALSE(fisheye.unproject({std::numeric_limits<double>::infinity(), 3}, &ray));
  const Camera radtan(models()[1].k);
  EXPECT_FALSE(radtan.unproject({1e7, -1e7}, &ray));
  EXPECT_EQ(ray, Vec3(7, 7, 7)) << "untouched";
}

TEST(Camera, invalidPointLeavesTheOutputsUnchanged) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const Model& model : models()) {
    const Camera camera(model.k);
    for (const Vec3& p :
         {Vec3(0, 0, 0), Vec3(1, 1, -5), Vec3(0, 0, kMinDepth / 2), Vec3(0, 0, nan)}) {
      Vec2 pixel(-1, -2);
      Mat23 J = Mat23::Constant(-3);
      EXPECT_EQ(camera.project(p, &pixel, &J), ProjectStatus::behind) << model.name;
      EXPECT_EQ(pixel, Vec2(-1, -2));
      EXPECT_EQ(J, Mat23::Constant(-3));
    }
    for (const Vec3& p : {Vec3(nan, 0, 1), Vec3(0, nan, 1)}) {
      Vec2 pixel(-1, -2);
      EXPECT_NE(camera.project(p, &pixel, nullptr), ProjectStatus::ok) << model.name;
      EXPECT_EQ(pixel, Vec2(-1, -2));
    }
  }
}

TEST(Camera, pointBeyondTheFoldIsRefused) {
  // r (1 − 0.3 r²) grows up to r = 1/√0.9 ≈ 1.054 and comes back: r = 1.5 would land on the pixel
  // of r = 0.53.
  Intrinsics k = intrinsics(CameraModelKind::pinhole_radtan, 640, 480, {400, 400, 320, 240},
                            {-0.3, 0, 0, 0, 0});
  const Camera camera(k);
  Vec2 pixel(-1, -2);
  Mat23 J = Mat23::Zero();
  EXPECT_EQ(camera.project({1.0, 0, 1}, &pixel, &J), ProjectStatus::ok);
  pixel = {-1, -2};
  EXPECT_EQ(camera.project({1.06, 0, 1}, &pixel, &J), ProjectStatus::folded);
  EXPECT_EQ(camera.project({0, -15, 10}, &pixel, &J), ProjectStatus::folded);
  EXPECT_EQ(pixel, Vec2(-1, -2));
}

}  // namespace
}  // namespace vergence
