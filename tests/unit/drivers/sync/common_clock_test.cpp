/// Pairing by the stamps of one clock: the bus's, PTP's, the host's.
#include "core/math/random.hpp"

#include <gtest/gtest.h>

#include "drivers/sync/clock_tie.hpp"
#include "drivers/sync/durations.hpp"
#include "tests/unit/drivers/sync/rig_frames.hpp"

namespace vergence {
namespace {

using namespace testing;

struct CommonClock : ::testing::TestWithParam<SyncMode> {};

TEST_P(CommonClock, pairsAreFormedByItsStampsAlone) {
  RigSynchronizer sync(rig_options(GetParam()));
  RigSets out;
  Random random(3);
  // During four minutes the bus's clock wraps once.
  for (int n = 0; n < 6000; ++n) {
    const DeviceStamp t(50'000'000'000 + (kRigInterval * n).ns());
    // Counters mean nothing, and the host's stamps are off by nearly half an interval.
    for (int k = 0; k < 2; ++k) {
      if (n == 100 && k == 1) continue;
      SyncFrame f = rig_frame(k, n, random.next(), rig_time(n), t + Duration::microseconds(k * 80));
      f.middle.host = f.middle.host + Duration::milliseconds(19 * k);
      EXPECT_EQ(out.offer(&sync, f), SyncResult::accepted) << n;
    }
  }
  sync.finish();
  out.drain(&sync);
  out.expect_pairs();
  EXPECT_EQ(out.complete(), 5999U);
  EXPECT_EQ(sync.counters().lost[1], 1U);
  for (const SyncedSet& s : out.sets) EXPECT_EQ(s.proof, SyncProof::common_clock);
  EXPECT_TRUE(sync.verified(0));
}

/// By a clock that goes right.
constexpr std::int64_t clock_ns(int pulse) { return 90'000'000'000 + (kRigInterval * pulse).ns(); }

TEST_P(CommonClock, driftOfAnIntervalVerifiesNothing) {
  RigSynchronizer sync(rig_options(GetParam()));
  // Camera 1's clock loses its master at n = 500 and gains 2 ms a second from then on: a whole
  // interval after 20 s.
  const RigSets out = sets_of(&sync, 1200, [](int n, int k) {
    return clock_ns(n) + (k == 1 && n > 500 ? 80'000 * (n - 500) : 0);
  });
  std::uint64_t doubted = 0;
  for (const SyncedSet& s : out.sets) {
    const bool together = s.spread < kRigInterval / 2;
    EXPECT_EQ(s.proof, together ? SyncProof::common_clock : SyncProof::ambiguous) << s.number;
    doubted += together ? 0 : 1;
  }
  EXPECT_GT(doubted, 40U) << "an exposure and the next";
  EXPECT_EQ(sync.counters().ambiguous, doubted);
}

TEST(OneClock, differentClockOfOneCameraVerifiesNothing) {
  for (const std::int64_t step : {-50'000'000'000, 1'700'000'000'000'000'000}) {
    RigSynchronizer sync(rig_options(SyncMode::ptp));
    RigSets out;
    std::size_t at_step = 0, at_return = 0;
    for (int n = 0; n < 300; ++n) {
      if (n == 100) at_step = out.sets.size();
      if (n == 200) at_return = out.sets.size();
      for (int k = 0; k < 2; ++k) {
        const std::int64_t set = k == 1 && n >= 100 && n < 200 ? step : 0;
        (void)out.offer(&sync, rig_frame(k, n, 0, rig_time(n), DeviceStamp(clock_ns(n) + set)));
      }
    }
    sync.finish();
    out.drain(&sync);
    for (std::size_t i = 0; i < out.sets.size(); ++i) {
      const bool apart = i >= at_step + 3 && i < at_return;
      const bool unsure =
          (i >= at_step && i < at_step + 3) || (i >= at_return && i < at_return + 5);
      if (unsure) continue;
      EXPECT_EQ(out.sets[i].proof, apart ? SyncProof::ambiguous : SyncProof::common_clock) << i;
    }
    EXPECT_EQ(out.complete(), 200U);
    EXPECT_EQ(sync.counters().missed, 0U);
  }
}

INSTANTIATE_TEST_SUITE_P(Modes, CommonClock,
                         ::testing::Values(SyncMode::ieee1394_cycle_time, SyncMode::ptp));

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
