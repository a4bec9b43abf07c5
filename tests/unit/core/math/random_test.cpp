#include "core/math/random.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

namespace vergence {
namespace {

TEST(Random, sequenceIsThatOfPcg32) {
  // The reference implementation's own demonstration: seed 42, stream 54.
  Random random(42, 54);
  for (const std::uint32_t expected :
       {0xa15c02b7U, 0x7b47f409U, 0xba1d3330U, 0x83d2f293U, 0xbfa4784bU, 0xcbed606eU})
    EXPECT_EQ(random.next(), expected);
}

TEST(Random, uniformIsEvenAndBelowOne) {
  Random random(3);
  constexpr int kDraws = 100000;
  double sum = 0, least = 1, most = 0;
  for (int i = 0; i < kDraws; ++i) {
    const double u = random.uniform();
    ASSERT_GE(u, 0.0);
    ASSERT_LT(u, 1.0);
    sum += u;
    least = std::min(least, u);
    most = std::max(most, u);
  }
  // The tolerance is five sigmas of the mean.
  EXPECT_NEAR(sum / kDraws, 0.5, 5 * std::sqrt(1.0 / 12 / kDraws));
  EXPECT_LT(least, 1e-3);
  EXPECT_GT(most, 1 - 1e-3);
}

TEST(Random, belowIsEvenAndInRange) {
  Random random(4);
  std::array<int, 7> seen{};
  constexpr int kDraws = 70000;
  for (int i = 0; i < kDraws; ++i) {
    const std::uint32_t n = random.below(7);
    ASSERT_LT(n, 7U);
    ++seen[n];
  }
  for (const int n : seen) EXPECT_NEAR(n, kDraws / 7, 5 * std::sqrt(kDraws / 7.0));
  for (int i = 0; i < 10; ++i) EXPECT_EQ(random.below(1), 0U);
}

}  // namespace
}  // namespace vergence
