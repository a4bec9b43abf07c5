#include <gtest/gtest.h>

#include "tests/support/shared_data.hpp"
#include "tests/system/odometry/faults.hpp"
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
  void expect_no_wrong_ok(const Replay& r, std::size_t first, std::size_t last) const {
    EXPECT_EQ(count_ok(r.answers, first, last), 0) << story(r.answers);
    EXPECT_EQ(wrong_ok(r.answers, bound()), "") << story(r.answers);
    EXPECT_EQ(r.allocations, 0U);
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

TEST_P(RecordedDrive, withItsCamerasExchangedNeverGivesAPose) {
  const Replay r = replay(drive_, swap_cameras(0, drive_.size()), 2);
  expect_no_wrong_ok(r, 0, drive_.size());
  for (const Answer& a : r.answers) EXPECT_EQ(a.sample.status, PoseStatus::lost) << a.sample.frame;
}

TEST_P(RecordedDrive, afterTwoSecondsWithoutFramesItSaysSo) {
  const std::size_t back = 20 + GetParam().frames_of_a_gap;
  const Replay r = replay(drive_, leave_out(20, back), 2);
  expect_no_wrong_ok(r, back, back + 1);
  EXPECT_NE(r.answers.back().sample.status, PoseStatus::lost) << story(r.answers);
}

INSTANTIATE_TEST_SUITE_P(Excerpts, RecordedDrive, testing::Values(kKitti, kEuroc),
                         [](const auto& instance) { return std::string(instance.param.name); });

}  // namespace
}  // namespace vergence::test
