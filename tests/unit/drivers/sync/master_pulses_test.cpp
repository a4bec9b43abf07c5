#include "drivers/sync/master_pulses.hpp"

#include <gtest/gtest.h>

namespace vergence {
namespace {

constexpr Duration kInterval = Duration::milliseconds(50);

/// Camera 0's frame of this counter, exposed at this pulse of an even train by its own clock.
SyncFrame frame(std::uint64_t counter, std::int64_t pulse) {
  SyncFrame f;
  f.counter = counter;
  f.exposure_start = DeviceStamp(0) + kInterval * pulse;
  f.exposure = Duration::milliseconds(8);
  f.middle = {HostStamp(9'000'000'000) + kInterval * pulse + f.exposure / 2,
              Duration::microseconds(40)};
  return f;
}

TEST(MasterPulses, aFrameIsAPulseAtTheStartOfItsExposure) {
  MasterPulses master(kInterval);
  const MasterPulses::Report report = master.frame(frame(12, 3));
  EXPECT_EQ(report.pulse.number, 12U);
  EXPECT_EQ(report.pulse.edge, DeviceStamp(0) + kInterval * 3);
  EXPECT_TRUE(report.pulse.mapped);
  EXPECT_EQ(report.pulse.host, HostStamp(9'000'000'000) + kInterval * 3);
  EXPECT_EQ(report.pulse.host_error, Duration::microseconds(40));
  EXPECT_TRUE(report.pulse.resumed) << "the first";
  EXPECT_FALSE(master.frame(frame(13, 4)).pulse.resumed);
}

TEST(MasterPulses, countsWithoutFramesAreLostAndTheirPulsesWentOutAllTheSame) {
  MasterPulses master(kInterval);
  (void)master.frame(frame(0, 0));
  const MasterPulses::Report report = master.frame(frame(3, 3));
  EXPECT_EQ(report.lost, 2U);
  EXPECT_EQ(report.pulse.number, 3U);
  EXPECT_FALSE(report.pulse.resumed);
}

TEST(MasterPulses, aFrameLaterThanItsCounterSaysComesAfterAPause) {
  MasterPulses master(kInterval);
  (void)master.frame(frame(0, 0));
  const MasterPulses::Report report = master.frame(frame(1, 5));
  EXPECT_TRUE(report.pulse.resumed);
  EXPECT_EQ(report.lost, 0U);
}

TEST(MasterPulses, theSameFrameOnceMoreMakesNoPulse) {
  MasterPulses master(kInterval);
  (void)master.frame(frame(4, 4));
  EXPECT_TRUE(master.frame(frame(4, 4)).again);
  EXPECT_EQ(master.frame(frame(5, 5)).lost, 0U);
}

TEST(MasterPulses, aCounterThatRunsBackIsAnotherBoot) {
  MasterPulses master(kInterval);
  (void)master.frame(frame(4, 4));
  const MasterPulses::Report report = master.frame(frame(2, 5));
  EXPECT_TRUE(report.contradicted);
  EXPECT_EQ(report.pulse.boot, 1U);
  EXPECT_EQ(master.frame(frame(3, 6)).pulse.boot, 1U);
}

TEST(MasterPulses, overARestartTheNumbersGoOnByItsClock) {
  MasterPulses master(kInterval);
  (void)master.frame(frame(40, 40));
  master.restart();
  const MasterPulses::Report report = master.frame(frame(0, 52));
  EXPECT_EQ(report.pulse.number, 52U);
  EXPECT_TRUE(report.pulse.resumed);
  EXPECT_FALSE(report.contradicted);
  EXPECT_EQ(master.frame(frame(1, 53)).pulse.number, 53U);
}

TEST(MasterPulses, aRestartBeforeTheFirstFrameChangesNothing) {
  MasterPulses master(kInterval);
  master.restart();
  EXPECT_EQ(master.frame(frame(6, 0)).pulse.number, 6U);
}

}  // namespace
}  // namespace vergence
