#include "core/math/random.hpp"

#include <gtest/gtest.h>

#include <array>

namespace vergence {
namespace {

TEST(Random, sequenceIsThatOfPcg32) {
  // The reference implementation's own demonstration: seed 42, stream 54.
  Random random(42, 54);
  for (const std::uint32_t expected :
       {0xa15c02b7U, 0x7b47f409U, 0xba1d3330U, 0x83d2f293U, 0xbfa4784bU, 0xcbed606eU})
    EXPECT_EQ(random.next(), expected);
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
