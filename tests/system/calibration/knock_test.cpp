#include <gtest/gtest.h>

#include "tests/system/calibration/knock.hpp"

namespace vergence::test {
namespace {

TEST(Knock, aPitchOfAFifthOfADegree) {
  expect_noticed_and_mended({"pitch 0.2 deg", {0.2, 0, 0}, {0, 0, 0}, 10});
}
TEST(Knock, aYawOfThreeTenths) {
  expect_noticed_and_mended({"yaw 0.3 deg", {0, 0.3, 0}, {0, 0, 0}, 30});
}
TEST(Knock, aShiftAlongTheViewIsLearnt) {
  expect_taken_up({"t_z 10 mm", {0, 0, 0}, {0, 0, 10}, 150, true, 220});
}

}  // namespace
}  // namespace vergence::test
