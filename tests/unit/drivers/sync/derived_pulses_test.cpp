#include "drivers/sync/master_pulses.hpp"

#include <gtest/gtest.h>

#include "drivers/sync/sync_out_pulses.hpp"

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

/// The rate of the pulses is written with six digits, the device's own is 400 Hz / n: over a long
/// drive the difference must add up to nothing.

// Times in ns.
constexpr std::int64_t kBegin = 1'000'000'000, kTenHours = 36'000'000'000'000;
// Sample interval in ns.
constexpr std::int64_t kSample = 10'000'000;
// Offset of the host's clock before the device's, in ns.
constexpr std::int64_t kOffset = 5;

/// Result of ten hours.
struct Account {
  std::int64_t taken = 0, wrong = 0;

  void add(const std::optional<Pulse>& p, std::int64_t number, std::int64_t edge) {
    if (!p) return;
    ++taken;
    const Duration off = p->host - HostStamp(edge + kOffset);
    const bool right = p->number == static_cast<std::uint64_t>(number) && off <= p->host_error &&
                       -off <= p->host_error;
    wrong += right ? 0 : 1;
  }
};

std::optional<Pulse> read(SyncOutPulses* pulses, std::int64_t sample) {
  InsReading r{.measured = DeviceStamp(sample)};
  r.quality.sync_out = true;
  return pulses->reading(r, {HostStamp(sample + kOffset), Duration::microseconds(9)});
}

TEST(SyncOutPulses, marksMatchThePulsesForHours) {
  // The rate is 400 Hz / 15, about 26.67 Hz.
  constexpr std::int64_t kPulse = 37'500'000;
  for (const double rate : {26.6667, 26.6666}) {
    SyncOutPulses pulses(Duration::seconds(1 / rate));
    Account account;
    std::int64_t n = 0;
    for (std::int64_t edge = kBegin; edge < kTenHours; edge += kPulse, ++n)
      account.add(read(&pulses, (edge + kSample - 1) / kSample * kSample), n, edge);
    EXPECT_EQ(account.wrong, 0) << rate;
    EXPECT_EQ(account.taken, n) << rate;
  }
}

TEST(SyncOutPulses, intervalOffTheDeviceGridIsKept) {
  // The interval is 0.27 % off 400 Hz / 15.
  constexpr std::int64_t kPulse = 37'600'000;
  SyncOutPulses pulses(Duration::nanoseconds(kPulse));
  Account account;
  for (std::int64_t n = 0; n < 10'000; ++n) {
    const std::int64_t edge = kBegin + n * kPulse;
    account.add(read(&pulses, edge), n, edge);
  }
  EXPECT_EQ(account.wrong, 0);
  EXPECT_EQ(account.taken, 10'000);
}

}  // namespace
}  // namespace vergence
