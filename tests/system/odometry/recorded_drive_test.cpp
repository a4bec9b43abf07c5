#include <gtest/gtest.h>

#include "tests/support/shared_data.hpp"
#include "tests/system/odometry/estimator_run.hpp"
#include "tests/system/odometry/recorded_drive.hpp"

namespace vergence::test {
namespace {

class RecordedDrive : public testing::TestWithParam<Excerpt> {
 protected:
  void SetUp() override {
    const auto folder = shared_data(GetParam().folder);
    if (!folder) GTEST_SKIP() << shared_data_missing(GetParam().folder);
    drive_ = load(GetParam(), *folder);
    ASSERT_GT(drive_.size(), 45U);
  }
  /// The ground truth has errors of its own: EuRoC's of a centimetre, KITTI's calibration of half a
  /// per cent and a degree of yaw over the excerpt.
  static constexpr OkBound kBound{.translation = 0.05, .per_metre = 0.02, .rotation = 0.02};
  StereoDrive drive_;
};

TEST_P(RecordedDrive, isOkAndAccurate) {
  EstimatorRun run(with_supplied(drive_.rig));
  run.process(drive_);
  EXPECT_EQ(count_usable(run.results(), 0, drive_.size()), static_cast<int>(drive_.size()))
      << run.describe();
  EXPECT_EQ(false_ok(run.results(), kBound), "");
  EXPECT_EQ(run.allocations(), 0U);
}

INSTANTIATE_TEST_SUITE_P(Excerpts, RecordedDrive, testing::Values(kKitti, kEuroc),
                         [](const auto& instance) { return std::string(instance.param.name); });

}  // namespace
}  // namespace vergence::test
