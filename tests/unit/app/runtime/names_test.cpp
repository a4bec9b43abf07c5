#include "app/runtime/nearest.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace vergence::app {
namespace {

using Names = std::vector<std::string>;

TEST(EditDistance, hasKnownDistances) {
  EXPECT_EQ(edit_distance("", ""), 0U);
  EXPECT_EQ(edit_distance("abc", ""), 3U);
  EXPECT_EQ(edit_distance("kitten", "sitting"), 3U);
  EXPECT_EQ(edit_distance("replay", "repaly"), 1U) << "two neighbours exchanged are one slip";
  EXPECT_EQ(edit_distance("Features", "features"), 0U) << "upper and lower case alike";
}

TEST(Nearest, isEmptyWithoutASimilarWord) {
  EXPECT_EQ(nearest("xyzzy", {"replay", "evaluate"}), std::nullopt);
  EXPECT_EQ(nearest("replay", {}), std::nullopt);
  EXPECT_EQ(did_you_mean("xyzzy", {"replay"}), "");
}

}  // namespace
}  // namespace vergence::app
