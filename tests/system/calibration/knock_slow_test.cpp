#include <gtest/gtest.h>

#include "tests/system/calibration/knock.hpp"

namespace vergence::test {
namespace {

TEST(KnockSlow, aPitchThatLeavesNoMatches) {
  expect_noticed_and_mended({"pitch 2 deg", {2, 0, 0}, {0, 0, 0}, 10, false});
}
TEST(KnockSlow, aTwentiethOfADegree) {
  expect_noticed_and_mended({"pitch 0.05 deg", {0.05, 0, 0}, {0, 0, 0}, 30});
}
TEST(KnockSlow, aRollOfATenth) {
  expect_noticed_and_mended({"roll 0.1 deg", {0, 0, 0.1}, {0, 0, 0}, 30, true, 130});
}
TEST(KnockSlow, aShiftUpwards) {
  expect_noticed_and_mended({"t_y 4 mm", {0, 0, 0}, {0, 4, 0}, 60, true, 220});
}

}  // namespace
}  // namespace vergence::test
