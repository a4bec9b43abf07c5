#include "drivers/iidc/budget_words.hpp"

#include <gtest/gtest.h>

#include <array>
#include <string>

namespace vergence::iidc {
namespace {

TEST(BudgetWords, WhatFitsIsNotCommentedOn) {
  const BusShare one{4608, BusSpeed::s800, 1280 * 960};
  EXPECT_EQ(budget_error(std::array{one, one}), "");  // 4620 of 4915
  EXPECT_EQ(budget_error({}), "");
}

TEST(BudgetWords, WhatDoesNotFitIsSaidInNumbersWithAWayOut) {
  const BusShare one{6680, BusSpeed::s800, 1280 * 960};
  const std::string text = budget_error(std::array{one, one});
  EXPECT_EQ(text,
            "2 cameras need 3346 + 3346 = 6692 of the bus's 4915 bandwidth units; packets of at "
            "most 4900 bytes each (31.75 Hz at this size) "
            "fit at S800: lower the rate or the image size, or use a second bus");
  const BusShare slow{4096, BusSpeed::s400, 640 * 480};
  EXPECT_NE(budget_error(std::array{slow, slow}).find("or use S800"), std::string::npos);
}

}  // namespace
}  // namespace vergence::iidc
