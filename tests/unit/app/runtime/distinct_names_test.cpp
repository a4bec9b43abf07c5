#include "app/runtime/distinct_names.hpp"

#include <gtest/gtest.h>

namespace vergence::app {
namespace {

using Names = std::vector<std::string>;

TEST(DistinctNames, onlyThoseThatAreThereAlreadyAreChanged) {
  EXPECT_EQ(distinct_names({"left", "right", "camera2"}), (Names{"left", "right", "camera2"}));
  EXPECT_EQ(distinct_names({"left", "left", "left"}), (Names{"left", "left_1", "left_2"}));
  EXPECT_EQ(distinct_names({"left", "left_1", "left"}), (Names{"left", "left_1", "left_2"}));
  EXPECT_EQ(distinct_names({"left", "left", "left_1"}), (Names{"left", "left_1", "left_1_1"}));
}

}  // namespace
}  // namespace vergence::app
