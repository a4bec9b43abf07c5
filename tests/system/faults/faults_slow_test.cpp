// Effects of a long standstill. `fault_injection_bench` drives the other long faults, two at a time
// and 500 random schedules.
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/system/faults/fault_drive.hpp"

namespace vergence::test {
namespace {

// A drift of millimetres a second is normal on the way and a hundred metres in an hour's stand.
TEST(LongFaults, tenMinutesOfStandingMovePoseByCentimetres) {
  // Limit in m.
  constexpr double kMax = 0.1;
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
  EXPECT_LT(motion.t.norm(), kMax);
}

}  // namespace
}  // namespace vergence::test
