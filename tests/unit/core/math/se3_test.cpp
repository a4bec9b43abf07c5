#include "core/math/se3.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <numbers>

namespace vergence {
namespace {

// Rounding of metres of order ten.
constexpr double kRounding = 1e-14;

Transform some(double k) { return {exp_so3({0.3 * k, -0.7, 0.2 + k}), Vec3(k, 2 - k, 5)}; }

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

}  // namespace
}  // namespace vergence
