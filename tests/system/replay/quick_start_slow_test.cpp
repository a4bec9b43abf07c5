// A first drive of which nothing is known but focal length and baseline, on recorded images.

#include "app/config/calibration_file.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/system/replay/quick_start.hpp"

namespace vergence::test {
namespace {

TEST_F(QuickStart, focalLengthAndBaselineCalibrateEuroc) {
  const auto folder = shared_data("data/euroc_mh01");
  if (!folder) GTEST_SKIP() << shared_data_missing("data/euroc_mh01");
  const Outcome o = replay(*folder, "--focal 460 --baseline 0.11");
  ASSERT_EQ(o.code, 0) << o.err;
  EXPECT_GT(summary()["frames"]["ok"], 50);
  EXPECT_LT(summary()["metrics"]["ate_m"], 0.006) << "4 mm with the data set's own calibration";
  const app::CalibrationFile found = app::read_calibration(session() / "calibration.yaml");
  EXPECT_NEAR(found.rig.intrinsics[0].distortion[0], -0.283, 0.02) << "without an initial value";
}

}  // namespace
}  // namespace vergence::test
