#include "core/odometry/undistorted_camera.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>

#include "core/math/random.hpp"

namespace vergence::odometry {
namespace {

Intrinsics wide_lens(CameraModelKind kind) {
  Intrinsics k{kind, 752, 480, 458.6, 457.3, 367.2, 248.4};
  if (kind == CameraModelKind::pinhole_radtan)
    k.distortion = {-0.28, 0.074, 0.0002, 0.00002, 0};
  else
    k.distortion = {-0.015, 0.004, -0.003, 0.0006, 0};
  return k;
}

constexpr CameraModelKind kModels[] = {CameraModelKind::pinhole_radtan,
                                       CameraModelKind::pinhole_equidistant};

TEST(UndistortedCamera, idealPixelIsThePinholePixelOfTheRay) {
  for (const CameraModelKind kind : kModels) {
    const UndistortedCamera lens(wide_lens(kind));
    Random random(3);
    for (int i = 0; i < 200; ++i) {
      const Vec2 raw(random.uniform(20, 732), random.uniform(20, 460));
      Vec2 ideal, back;
      Vec3 ray;
      double magnification = 0;
      ASSERT_TRUE(lens.undistort(raw, &ideal, &magnification));
      ASSERT_TRUE(lens.ideal().unproject(ideal, &ray));
      ASSERT_EQ(lens.raw().project(ray, &back, nullptr), ProjectStatus::ok);
      // Newton's method in unproject() ends at this accuracy.
      EXPECT_LT((back - raw).norm(), 1e-8);
    }
  }
}

TEST(UndistortedCamera, derivativesMatchFiniteDifferences) {
  for (const CameraModelKind kind : kModels) {
    const UndistortedCamera lens(wide_lens(kind));
    Random random(4);
    for (int i = 0; i < 100; ++i) {
      const Vec2 raw(random.uniform(20, 732), random.uniform(20, 460));
      // Step in px. The third derivative leaves 1e-6 of it, Newton's end 1e-8 / step.
      constexpr double kStep = 1e-3;
      Vec3 ray;
      Mat2 J, ideal_by_raw, ray_by_raw;
      ASSERT_TRUE(lens.ray_jacobian(raw, &ray, &J));
      for (int c = 0; c < 2; ++c) {
        Vec2 plus, minus;
        Vec3 ray_plus, ray_minus;
        Mat2 ignored;
        double magnification = 0;
        const Vec2 step = kStep * Vec2::Unit(c);
        ASSERT_TRUE(lens.undistort(raw + step, &plus, &magnification));
        ASSERT_TRUE(lens.undistort(raw - step, &minus, &magnification));
        ASSERT_TRUE(lens.ray_jacobian(raw + step, &ray_plus, &ignored));
        ASSERT_TRUE(lens.ray_jacobian(raw - step, &ray_minus, &ignored));
        ideal_by_raw.col(c) = (plus - minus) / (2 * kStep);
        ray_by_raw.col(c) = (ray_plus - ray_minus).head<2>() / (2 * kStep);
      }
      EXPECT_LT((J - ray_by_raw).norm(), 1e-4 * J.norm());
      Vec2 ideal;
      double magnification = 0;
      ASSERT_TRUE(lens.undistort(raw, &ideal, &magnification));
      EXPECT_NEAR(magnification, std::sqrt(std::abs(ideal_by_raw.determinant())),
                  1e-4 * magnification);
    }
  }
}

TEST(UndistortedCamera, undistortedLensMovesNothing) {
  Intrinsics k = wide_lens(CameraModelKind::pinhole_radtan);
  k.distortion = {};
  const UndistortedCamera lens(k);
  Vec2 ideal;
  double magnification = 0;
  ASSERT_TRUE(lens.undistort({17.25, 401.5}, &ideal, &magnification));
  EXPECT_EQ(ideal, Vec2(17.25, 401.5));
  EXPECT_EQ(magnification, 1.0);
}

TEST(UndistortedCamera, pixelBeyondTheFoldIsRefused) {
  Intrinsics k = wide_lens(CameraModelKind::pinhole_radtan);
  // The lens folds at r² = 2/3, so no ray is seen beyond 0.54 · 458 px.
  k.distortion = {-0.5, 0, 0, 0, 0};
  const UndistortedCamera lens(k);
  Vec2 ideal(1, 2);
  Vec3 ray;
  Mat2 J;
  double magnification = 0;
  EXPECT_FALSE(lens.undistort({740, 470}, &ideal, &magnification));
  EXPECT_FALSE(lens.ray_jacobian({740, 470}, &ray, &J));
}

}  // namespace
}  // namespace vergence::odometry
