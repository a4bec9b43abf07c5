// Faults two at a time, and 500 random schedules.
#include <gtest/gtest.h>

#include "tests/system/faults/fault_drive.hpp"

namespace vergence::test {
namespace {

void expect_honest(const std::vector<FaultCase>& cases) {
  const FaultDrive untouched = drive_with_faults(no_fault());
  const NormalError normal = normal_error_there(untouched.poses, untouched.truth);
  for (const FaultCase& c : cases) {
    const auto [drive, result] = drive_until_recovered(c, normal);
    SCOPED_TRACE(fault_table_line(c, drive, result) + drive.err);
    EXPECT_EQ(drive.code, 0);
    EXPECT_TRUE(drive.whole);
    EXPECT_EQ(result.honesty.wrong, 0) << "from line " << result.honesty.first_wrong;
    EXPECT_TRUE(result.recovery_s) << "not usable any more";
  }
}

TEST(FaultPairs, leaveNoWrongOkAndAWholeSession) { expect_honest(fault_pairs()); }

TEST(LongFaults, aStandAStalledDiskAndAClockThatIsSetLeaveNoWrongOkAndAWholeSession) {
  expect_honest(long_faults());
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
