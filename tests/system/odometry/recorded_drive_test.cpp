#include <gtest/gtest.h>

#include "tests/support/shared_data.hpp"
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
  /// Truth here has errors of its own: EuRoC's of a centimetre, KITTI's calibration of half a per
  /// cent and a degree of yaw over the excerpt.
  [[nodiscard]] static OkBound bound() {
    OkBound b;
    b.translation = 0.05;
    b.per_metre = 0.02;
    b.rotation = 0.02;
    return b;
  }
  StereoDrive drive_;
};

TEST_P(RecordedDrive, isOkAllTheWayAndRight) {
  const Replay r = replay(drive_, {}, 2);
  EXPECT_EQ(count_ok(r.answers, 0, drive_.size()), static_cast<int>(drive_.size()))
      << story(r.answers);
  EXPECT_EQ(wrong_ok(r.answers, bound()), "");
  EXPECT_EQ(r.allocations, 0U);
}

INSTANTIATE_TEST_SUITE_P(Excerpts, RecordedDrive, testing::Values(kKitti, kEuroc),
                         [](const auto& instance) { return std::string(instance.param.name); });

}  // namespace
}  // namespace vergence::test
