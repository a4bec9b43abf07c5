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
// 0.4 % of the depth: too little for the monitor. The first full segment of frames after it, 300 to
// 450, shows it.
TEST(Knock, aShiftAlongTheViewIsLearnt) {
  expect_taken_up({"t_z 10 mm", {0, 0, 0}, {0, 0, 10}, 240, true, 220});
}

}  // namespace
}  // namespace vergence::test
