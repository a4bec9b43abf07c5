#include "app/runtime/nearest.hpp"

#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace vergence::app {
namespace {

TEST(EditDistance, KnownAnswers) {
  EXPECT_EQ(edit_distance("", ""), 0U);
  EXPECT_EQ(edit_distance("abc", ""), 3U);
  EXPECT_EQ(edit_distance("kitten", "sitting"), 3U);
  EXPECT_EQ(edit_distance("replay", "repaly"), 1U) << "two neighbours exchanged are one slip";
  EXPECT_EQ(edit_distance("Features", "features"), 0U) << "upper and lower case alike";
}

TEST(EditDistance, IsSymmetricAndBounded) {
  const std::vector<std::string> words{
      "a", "ab", "ba", "threads", "odometry.features", "odometry.feature"};
  for (const auto& a : words)
    for (const auto& b : words) {
      EXPECT_EQ(edit_distance(a, b), edit_distance(b, a)) << a << ' ' << b;
      EXPECT_LE(edit_distance(a, b), std::max(a.size(), b.size()));
    }
}

TEST(EditDistance, HugeWordsCostLittle) {
  EXPECT_LE(edit_distance(std::string(10'000'000, 'x'), "threads"), 256U);
}

TEST(Nearest, PicksTheLeastDistant) {
  EXPECT_EQ(nearest("evalute", {"replay", "evaluate", "simulate"}), "evaluate");
  EXPECT_EQ(nearest("thread", {"threads"}), "threads");
}

TEST(Nearest, GivesNothingWhenNothingIsNear) {
  EXPECT_EQ(nearest("xyzzy", {"replay", "evaluate"}), std::nullopt);
  EXPECT_EQ(nearest("replay", {}), std::nullopt);
  EXPECT_EQ(did_you_mean("xyzzy", {"replay"}), "");
}

}  // namespace
}  // namespace vergence::app
