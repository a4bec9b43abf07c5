// Faults two at a time, and 500 random schedules.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>

#include "tests/system/faults/fault_drive.hpp"

namespace vergence::test {
namespace {

void expect_honest(const std::vector<FaultCase>& cases) {
  const Untouched untouched = untouched_drive();
  ASSERT_EQ(untouched.unfit, "");
  for (const FaultCase& c : cases) {
    const auto [drive, result] = drive_until_recovered(c, untouched.normal);
    SCOPED_TRACE(fault_table_line(c, drive, result) + drive.err);
    EXPECT_FALSE(is_bad(drive, result)) << "from line " << result.honesty.first_wrong;
    EXPECT_TRUE(result.recovery_s) << "not usable any more";
    EXPECT_EQ(unsaid(c, drive, untouched.drive), "");
  }
}

TEST(FaultPairs, leaveNoWrongOkAndAWholeSession) { expect_honest(fault_pairs()); }

TEST(LongFaults, aStandAStalledDiskAndAClockThatIsSetLeaveNoWrongOkAndAWholeSession) {
  expect_honest(long_faults());
}

// A drift of millimetres a second is normal on the way and a hundred metres in an hour's stand.
TEST(LongFaults, aStandOfTenMinutesMovesThePoseByCentimetres) {
  constexpr double kMost = 0.1;  // m
  const FaultCase& c = long_faults().front();
  ASSERT_EQ(c.name, "standing 10 minutes");
  const FaultDrive drive = drive_with_faults(c);
  ASSERT_TRUE(drive.whole) << drive.err;
  const auto at = [&drive](double s) {
    return static_cast<std::size_t>(std::lower_bound(drive.at_s.begin(), drive.at_s.end(), s) -
                                    drive.at_s.begin());
  };
  // It stands from the first half minute of the stand on to the last.
  const std::size_t from = at(c.from_s + 30), to = at(c.until_s - 30);
  ASSERT_LT(to, drive.poses.size());
  const Transform motion = drive.poses[from].T_world_left.inverse() * drive.poses[to].T_world_left;
  const Transform *a = true_pose(drive.truth, drive.poses[from].stamp),
                  *b = true_pose(drive.truth, drive.poses[to].stamp);
  ASSERT_TRUE(a != nullptr && b != nullptr);
  EXPECT_LT((a->inverse() * *b).t.norm(), 1e-9) << "it does not stand";
  EXPECT_LT(motion.t.norm(), kMost);
}

class ManyFaults : public ::testing::TestWithParam<std::uint64_t> {};

TEST_P(ManyFaults, atRandomLeaveNoWrongOkAndAWholeSession) {
  constexpr std::uint64_t kEach = 50;
  std::vector<FaultCase> cases;
  for (std::uint64_t i = 1; i <= kEach; ++i) cases.push_back(random_faults(GetParam() * kEach + i));
  expect_honest(cases);
}

INSTANTIATE_TEST_SUITE_P(Seeds, ManyFaults, ::testing::Range<std::uint64_t>(0, 10));

}  // namespace
}  // namespace vergence::test
