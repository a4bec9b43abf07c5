#include "core/estimator/detail/covariance_baseline.hpp"

#include <gtest/gtest.h>

namespace vergence {
namespace {

// Number of motions that make the baseline usable.
constexpr int kEnough = 15;

CovarianceBaseline driven(int motions) {
  CovarianceBaseline baseline;
  for (int i = 0; i < motions; ++i) EXPECT_FALSE(baseline.update(0.010 + 0.002 * (i % 5)));
  // The median is 0.014.
  return baseline;
}

TEST(CovarianceBaseline, threeTimesTheUsualSigmaIsUnusual) {
  EXPECT_TRUE(driven(kEnough).update(0.043));
  EXPECT_FALSE(driven(kEnough).update(0.041));
  EXPECT_FALSE(driven(kEnough - 1).update(0.043)) << "too few to tell";
}

TEST(CovarianceBaseline, standingIsNotEvaluated) {
  EXPECT_FALSE(CovarianceBaseline{}.measurable(0.027, 0.014));
  EXPECT_TRUE(CovarianceBaseline{}.measurable(0.029, 0.014));
  const CovarianceBaseline baseline = driven(kEnough);
  EXPECT_FALSE(baseline.measurable(0.027, 0.001));
  EXPECT_TRUE(baseline.measurable(0.029, 0.1)) << "seven times the usual";
}

TEST(CovarianceBaseline, uncertaintyIsUnusualForAMinute) {
  CovarianceBaseline baseline = driven(200);
  for (int i = 1; i < 600; ++i) EXPECT_TRUE(baseline.update(0.1)) << i;
  for (int i = 0; i < 100; ++i) EXPECT_FALSE(baseline.update(0.1)) << i;
  EXPECT_TRUE(baseline.update(0.4));
  EXPECT_FALSE(baseline.update(0.014));
}

}  // namespace
}  // namespace vergence
