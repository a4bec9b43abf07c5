#include "drivers/sync/clock_tie.hpp"

#include <gtest/gtest.h>

#include "drivers/sync/durations.hpp"

namespace vergence {
namespace {

constexpr Duration kNoise = Duration::microseconds(20), kInterval = Duration::milliseconds(40);

/// The source's time of a stamp, where the camera's clock runs slow by `drift` and began later.
DeviceStamp source_of(DeviceStamp stamp, double drift) {
  return DeviceStamp(7'000'000'000) + (stamp - DeviceStamp(0)) +
         scaled(stamp - DeviceStamp(0), drift);
}

TEST(ClockTie, rateOfTwoCrystalsIsFound) {
  constexpr double kDrift = 100e-6;
  ClockTie tie(kNoise, kInterval);
  DeviceStamp stamp(0);
  for (int i = 0; i < 50; ++i, stamp = stamp + kInterval) tie.add(stamp, source_of(stamp, kDrift));
  // Without noise a line through the pairs is exact, but for the rounding to nanoseconds: half a
  // nanosecond a pair at the far end of the lever, which is as long ahead as it was behind.
  const DeviceStamp later = stamp + kInterval * 50;
  EXPECT_LE(magnitude(tie.to_edge(later) - source_of(later, kDrift)).ns(), 10);
}

TEST(ClockTie, gateGrowsUpToAFifthOfTheInterval) {
  ClockTie tie(kNoise, kInterval);
  tie.add(DeviceStamp(0), DeviceStamp(0));
  EXPECT_EQ(tie.gate(), kNoise * 4 + Duration::microseconds(50));
  EXPECT_EQ(tie.gate(DeviceStamp(0) + Duration::seconds(10)),
            tie.gate() + Duration::microseconds(300));
  const ClockTie noisy(Duration::milliseconds(30), kInterval);
  EXPECT_EQ(noisy.gate(DeviceStamp(0)), kInterval / 5);
}

}  // namespace
}  // namespace vergence
