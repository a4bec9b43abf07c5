#include "drivers/sync/master_pulses.hpp"

#include <gtest/gtest.h>

namespace vergence {
namespace {

constexpr Duration kInterval = Duration::milliseconds(50);

/// Camera 0's frame of this counter, exposed at this pulse of an even train by its own clock.
SyncFrame frame(std::uint64_t counter, std::int64_t pulse) {
  SyncFrame f{.counter = counter,
              .exposure_start = DeviceStamp(0) + kInterval * pulse,
              .exposure = Duration::milliseconds(8)};
  f.middle = {HostStamp(9'000'000'000) + kInterval * pulse + f.exposure / 2,
              Duration::microseconds(40)};
  return f;
}

TEST(MasterPulses, lateFrameByCounterFollowsAPause) {
  MasterPulses master(kInterval);
  (void)master.frame(frame(0, 0));
  const MasterPulses::Report report = master.frame(frame(1, 5));
  EXPECT_TRUE(report.pulse.resumed);
  EXPECT_EQ(report.lost, 0U);
}

TEST(MasterPulses, repeatedFrameMakesNoPulse) {
  MasterPulses master(kInterval);
  (void)master.frame(frame(4, 4));
  EXPECT_TRUE(master.frame(frame(4, 4)).again);
  EXPECT_EQ(master.frame(frame(5, 5)).lost, 0U);
}

TEST(MasterPulses, backwardCounterIsANewBoot) {
  MasterPulses master(kInterval);
  (void)master.frame(frame(4, 4));
  const MasterPulses::Report report = master.frame(frame(2, 5));
  EXPECT_TRUE(report.contradicted);
  EXPECT_EQ(report.pulse.boot, 1U);
  EXPECT_EQ(master.frame(frame(3, 6)).pulse.boot, 1U);
}

}  // namespace
}  // namespace vergence
