#include <gtest/gtest.h>

#include <array>
#include <limits>
#include <numbers>

#include "core/math/se3.hpp"

namespace vergence {
namespace {

constexpr double kPi = std::numbers::pi;
// A handful of roundings of numbers of order one.
constexpr double kRounding = 4e-15;
// Zero, tiny, both sides of the switch to series at 1e-4, ordinary, and as near to π as a double
// comes.
constexpr std::array kAngles = {0.0, 1e-9, 1e-5, 0.99e-4,    1.01e-4,   1e-3,
                                0.7, 2.0,  3.0,  kPi - 1e-5, kPi - 1e-9};

std::array<Vec3, 6> axes() {
  return {Vec3::UnitX(),
          Vec3::UnitY(),
          Vec3::UnitZ(),
          Vec3(1, 1, 1).normalized(),
          Vec3(-0.3, 0.9, -0.1).normalized(),
          Vec3(1e-8, -1, 1e-8).normalized()};
}

/// sin θ/θ, (1 − cos θ)/θ², (θ − sin θ)/θ³ by their series in extended precision: for θ ≤ π, 20
/// terms are exact to the last bit.
struct Coefficients {
  double a, b, c;
};
Coefficients by_series(double theta) {
  const long double t2 = static_cast<long double>(theta) * theta;
  // The factorial is that of 2k+1.
  long double a = 0, b = 0, c = 0, power = 1, factorial = 1;
  for (int k = 0; k < 20; ++k) {
    a += power / factorial;
    b += power / (factorial * (2 * k + 2));
    c += power / (factorial * (2 * k + 2) * (2 * k + 3));
    factorial *= static_cast<long double>(2 * k + 2) * (2 * k + 3);
    power *= -t2;
  }
  return {static_cast<double>(a), static_cast<double>(b), static_cast<double>(c)};
}

TEST(So3, expMatchesTheSeriesAtEveryAngle) {
  for (const Vec3& axis : axes())
    for (const double angle : kAngles) {
      const Mat3 R = exp_so3(angle * axis);
      const auto [a, b, c] = by_series(angle);
      const Mat3 K = skew(angle * axis);
      EXPECT_LT((R - (Mat3::Identity() + a * K + b * K * K)).norm(), kRounding) << angle;
      EXPECT_LT((R.transpose() * R - Mat3::Identity()).norm(), kRounding) << angle;
      EXPECT_NEAR(R.determinant(), 1.0, kRounding);
    }
}

TEST(So3, logInvertsExpUpToPi) {
  for (const Vec3& axis : axes())
    for (const double angle : kAngles)
      EXPECT_LT((log_so3(exp_so3(angle * axis)) - angle * axis).norm(), kRounding) << angle;
}

TEST(So3, logKeepsDigitsOfTinyAngles) {
  for (const Vec3& axis : axes())
    EXPECT_LT((log_so3(exp_so3(1e-9 * axis)) - 1e-9 * axis).norm(), 1e-9 * kRounding);
}

TEST(So3, logAtPiGivesEitherSignOfTheAxis) {
  for (const Vec3& axis : axes()) {
    const Mat3 R = exp_so3(kPi * axis);
    const Vec3 phi = log_so3(R);
    EXPECT_NEAR(phi.norm(), kPi, kRounding);
    EXPECT_LT((exp_so3(phi) - R).norm(), 2 * kRounding);
  }
  EXPECT_NEAR(rotation_angle(Vec3(1, -1, -1).asDiagonal()), kPi, kRounding);
}

TEST(So3, normalisedRestoresThousandRotations) {
  Mat3 R = Mat3::Identity();
  const Mat3 step = exp_so3({0.01, -0.02, 0.03});
  for (int i = 0; i < 1000; ++i) R = R * step;
  const Mat3 clean = normalised(R);
  EXPECT_LT((clean.transpose() * clean - Mat3::Identity()).norm(), kRounding);
  EXPECT_LT((clean - exp_so3({10, -20, 30})).norm(), 1000 * 1e-15);
}

// Rounding of metres of order ten.
constexpr double kPoseRounding = 1e-14;

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
  EXPECT_LT((moved.R - exp_so3(phi) * T.R).norm(), kPoseRounding);
  EXPECT_LT((moved.t - (T.t + tau)).norm(), kPoseRounding);
}

TEST(Quaternion, quaternionHasPositiveWAndRoundTrips) {
  for (const double angle : {0.0, 1e-9, 1.0, 3.0, std::numbers::pi - 1e-9, 4.0, 6.0}) {
    const Mat3 R = exp_so3(angle * Vec3(0.6, 0, -0.8));
    const Eigen::Quaterniond q = quaternion(R);
    EXPECT_GE(q.w(), 0);
    EXPECT_NEAR(q.norm(), 1, kPoseRounding);
    EXPECT_LT((q.toRotationMatrix() - R).norm(), kPoseRounding);
  }
}

}  // namespace
}  // namespace vergence
