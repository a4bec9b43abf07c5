#include "core/math/se3.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <numbers>

namespace vergence {
namespace {

// Rounding of metres of order ten.
constexpr double kRounding = 1e-14;

Transform some(double k) { return {exp_so3({0.3 * k, -0.7, 0.2 + k}), Vec3(k, 2 - k, 5)}; }

double apart(const Transform& a, const Transform& b) {
  return (a.R - b.R).norm() + (a.t - b.t).norm();
}

TEST(Transform, parallelCamerasShiftThePoint) {
  const Transform T_right_left{// The cameras are parallel and the right one is 0.75 m to the right.
                               Mat3::Identity(),
                               {-0.75, 0, 0}};
  EXPECT_TRUE((T_right_left * Vec3(0.75, 0, 4)).isApprox(Vec3(0, 0, 4)));
  EXPECT_TRUE(T_right_left.centre().isApprox(Vec3(0.75, 0, 0)));
}

TEST(Transform, compositionAndInverseAreAGroup) {
  const Transform a = some(0.1), b = some(1.3), c = some(-2.2);
  EXPECT_LT(apart((a * b) * c, a * (b * c)), kRounding);
  EXPECT_LT(apart(a * a.inverse(), Transform{}), kRounding);
  EXPECT_LT(apart(a.inverse() * a, Transform{}), kRounding);
  EXPECT_EQ(apart(a * Transform{}, a), 0);
  const Vec3 p(1, -2, 3);
  EXPECT_LT(((a * b) * p - a * (b * p)).norm(), kRounding);
}

TEST(Transform, nanOrInfinityIsNotFinite) {
  EXPECT_TRUE(some(1).finite());
  Transform T;
  T.t.y() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(T.finite());
  T = {};
  T.R(2, 0) = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(T.finite());
}

TEST(Transform, perturbationIsLeftForRotationOnly) {
  const Transform T = some(0.6);
  const Vec3 phi(1e-3, -2e-3, 5e-4), tau(0.1, 0.2, -0.3);
  const Transform moved = perturbed(T, phi, tau);
  EXPECT_LT((moved.R - exp_so3(phi) * T.R).norm(), kRounding);
  EXPECT_LT((moved.t - (T.t + tau)).norm(), kRounding);
}

TEST(Quaternion, quaternionHasPositiveWAndRoundTrips) {
  for (const double angle : {0.0, 1e-9, 1.0, 3.0, std::numbers::pi - 1e-9, 4.0, 6.0}) {
    const Mat3 R = exp_so3(angle * Vec3(0.6, 0, -0.8));
    const Eigen::Quaterniond q = quaternion(R);
    EXPECT_GE(q.w(), 0);
    EXPECT_NEAR(q.norm(), 1, kRounding);
    EXPECT_LT((q.toRotationMatrix() - R).norm(), kRounding);
  }
}

TEST(Interpolate, interpolationFollowsTheShorterArc) {
  // The shorter arc is 0.28 rad across π.
  const Transform a{exp_so3({0, 0, 3.0}), {0, 0, 0}}, b{exp_so3({0, 0, -3.0}), {2, 4, 6}};
  EXPECT_LT(apart(interpolate(a, b, 0), a), kRounding);
  EXPECT_LT(apart(interpolate(a, b, 1), b), kRounding);
  const Transform quarter = interpolate(a, b, 0.25);
  const double arc = 2 * std::numbers::pi - 6.0;
  EXPECT_LT((quarter.R - exp_so3({0, 0, 3.0 + 0.25 * arc})).norm(), kRounding);
  EXPECT_LT((quarter.t - Vec3(0.5, 1, 1.5)).norm(), kRounding);
}

}  // namespace
}  // namespace vergence
