/// Accuracy of the clocks over a link with delays of a constant floor and exponential jitter, and
/// that the bounds they state hold.

#include "core/math/random.hpp"
#include "drivers/sync/clock_mapper.hpp"
#include "drivers/sync/clock_tie.hpp"
#include "drivers/sync/durations.hpp"
#include "tests/support/quantile.hpp"
#include "tests/unit/drivers/sync/rig_frames.hpp"

namespace vergence {
namespace {

// Mean jitter in ns.
constexpr double kJitter = 2e6;

struct Line {
  double drift = 50e-6;
  std::int64_t offset = 987'654'321'012;
  // Minimum delays in ns.
  std::int64_t floor_there = 300'000, floor_back = 300'000;
  Random random;

  explicit Line(std::uint64_t seed) : random(seed) {}
  [[nodiscard]] DeviceStamp read(std::int64_t host) const {
    return DeviceStamp((host + offset + std::llround(drift * static_cast<double>(host))) / 1000 *
                       1000);
  }
  std::int64_t late() { return std::llround(-kJitter * std::log(1 - random.uniform())); }
  void ping(ClockMapper* clock, std::int64_t at) {
    const std::int64_t t2 = at + floor_there + late(), t3 = t2 + 20'000,
                       t4 = t3 + floor_back + late();
    clock->ping(HostStamp(at), read(t2), read(t3), HostStamp(t4));
  }
};

struct Errors {
  std::vector<double> ns;
  int outside = 0;

  void add(const MappedStamp& m, std::int64_t truth) {
    const std::int64_t off = m.host.ns() - truth;
    ns.push_back(static_cast<double>(off));
    outside += std::abs(off) > m.error.ns() ? 1 : 0;
  }
  [[nodiscard]] double rms() const {
    double sum = 0;
    for (const double e : ns) sum += e * e;
    return std::sqrt(sum / static_cast<double>(ns.size()));
  }
  [[nodiscard]] double p99() const {
    std::vector<double> absolute;
    for (const double e : ns) absolute.push_back(std::abs(e));
    return test::quantile(absolute, 0.99);
  }
};

ClockMapperOptions mapper_options(const Line& line, bool two_way) {
  ClockMapperOptions o;
  if (!two_way) o.min_delay = Duration::nanoseconds(line.floor_back);
  return o;
}

TEST(ClockBounds, settledErrorIsTwentyMicroseconds) {
  for (const bool two_way : {true, false}) {
    const int rate_hz = two_way ? 100 : 30, settled_s = two_way ? 10 : 30;
    Errors errors;
    for (std::uint64_t seed = 1; seed <= 200; ++seed) {
      Line line(seed);
      line.drift = seed % 2 == 0 ? 50e-6 : -50e-6;
      ClockMapper clock(mapper_options(line, two_way));
      for (int i = 0; i < rate_hz * settled_s * 3 / 2; ++i) {
        const std::int64_t t = 1'000'000'000 + std::llround(i * 1e9 / rate_hz);
        MappedStamp m;
        if (two_way)
          line.ping(&clock, t), m = clock.at(line.read(t));
        else
          m = clock.map(line.read(t), HostStamp(t + line.floor_back + line.late()));
        if (i >= rate_hz * settled_s) errors.add(m, t);
      }
      EXPECT_NEAR(clock.drift(), -line.drift / (1 + line.drift), 20e-6) << seed;
      EXPECT_EQ(clock.resets(), 0U);
    }
    EXPECT_LE(errors.rms(), 20e3) << two_way;
    EXPECT_LE(errors.p99(), 50e3) << two_way;
    EXPECT_LE(errors.outside, two_way ? 0 : static_cast<int>(errors.ns.size() / 1000));
  }
}

TEST(ClockBounds, boundsHoldFromTheFirstStampForAnyDelay) {
  Errors one_way, two_way;
  for (std::uint64_t seed = 1; seed <= 400; ++seed) {
    Line line(seed);
    line.drift = line.random.uniform(-100e-6, 100e-6);
    // The delays differ, which cannot be observed; the bound allows for it.
    line.floor_there = line.random.below(3'000'000);
    line.floor_back = line.random.below(3'000'000);
    ClockMapper arrivals(mapper_options(line, false)), pings(mapper_options(line, true));
    std::int64_t t = 1'000'000'000;
    const std::int64_t step = 5'000'000 + line.random.below(60'000'000);
    for (int i = 0; i < 800; ++i, t += step) {
      one_way.add(arrivals.map(line.read(t), HostStamp(t + line.floor_back + line.late())), t);
      line.ping(&pings, t);
      two_way.add(pings.at(line.read(t + 20'000'000)), t + 20'000'000);
    }
    EXPECT_EQ(arrivals.resets() + pings.resets(), 0U) << seed;
  }
  EXPECT_EQ(two_way.outside, 0) << "of " << two_way.ns.size();
  EXPECT_LE(one_way.outside, static_cast<int>(one_way.ns.size() / 1000))
      << "of " << one_way.ns.size();
}

TEST(ClockBounds, setClockIsFoundByTheNextPings) {
  for (const double step : {3600.0, 0.5, 0.003, -0.003, -0.5, -3600.0}) {
    Line line(5);
    ClockMapper clock(mapper_options(line, true));
    int outside = 0;
    std::int64_t t = 1'000'000'000;
    for (int i = 0; i < 4000; ++i, t += 10'000'000) {
      if (i == 2000) line.offset += std::llround(step * 1e9);
      line.ping(&clock, t);
      const MappedStamp m = clock.at(line.read(t));
      outside += std::abs(m.host.ns() - t) > m.error.ns() ? 1 : 0;
    }
    EXPECT_GE(clock.resets(), 1U) << step;
    // A small one shows when a ping is quick enough both ways: within the jitter's mean, a tenth of
    // them are.
    EXPECT_LE(outside, std::abs(step) > 0.1 ? 0 : 100) << step;
  }
}

TEST(ClockBounds, tenYearsStayExactToTheNanosecond) {
  constexpr std::int64_t kTenYears = 315'576'000'000'000'000;
  for (const std::int64_t offset : {kTenYears, -kTenYears}) {
    ClockMapperOptions o{.resolution = Duration::nanoseconds(1)};
    ClockMapper one(o), two(o);
    // No jitter, no drift: what is off is arithmetic. A minute of a stamp a second, then one every
    // 20 days or in the next second.
    std::int64_t t = 5'000'000'123;
    for (int i = 0; i < 240; ++i) {
      const DeviceStamp device(t + offset);
      EXPECT_EQ(one.map(device, HostStamp(t)).host, HostStamp(t)) << i;
      two.ping(HostStamp(t - 1'000'003), device, device + Duration::nanoseconds(7),
               HostStamp(t + 1'000'010));
      EXPECT_EQ(two.at(device).host, HostStamp(t)) << i;
      t += i < 60 || i % 3 != 0 ? 1'000'000'001 : 3 * 1'753'200'000'000'007;
    }
    EXPECT_EQ(one.resets() + two.resets(), 0U);
  }
}

// The process slept, and what its driver had queued comes at once: none is within the stall.
TEST(ClockBounds, backlogKeepsStampsMonotonic) {
  Line line(7);
  line.drift = 80e-6;
  ClockMapper clock(mapper_options(line, false));
  HostStamp last{};
  for (int i = 0; i < 5000; ++i) {
    const auto at = [](int n) { return 10'000'000'000 + n * std::int64_t{8'333'333}; };
    const bool queued = i >= 1000 && i < 1008;
    const std::int64_t late = queued ? at(999) + 950'000'000 - at(i)
                                     : std::min<std::int64_t>(line.late() / 13, 1'900'000);
    const MappedStamp m = clock.map(line.read(at(i)), HostStamp(at(i) + line.floor_back + late));
    ASSERT_LE(std::abs(m.host.ns() - at(i)), m.error.ns()) << i;
    ASSERT_GT(m.host, last) << i;
    last = m.host;
  }
  EXPECT_EQ(clock.resets(), 0U);
}

TEST(ClockBounds, randomStampsGiveNonNegativeErrors) {
  ClockMapper clock{ClockMapperOptions{}};
  Random random(4);
  for (int i = 0; i < 20'000; ++i) {
    const auto any = [&] {
      const std::uint64_t bits = (static_cast<std::uint64_t>(random.next()) << 32U) | random.next();
      return static_cast<std::int64_t>(bits) / 2;
    };
    if (random.below(2) == 0)
      clock.ping(HostStamp(any()), DeviceStamp(any()), DeviceStamp(any()), HostStamp(any()));
    const MappedStamp m = clock.map(DeviceStamp(any()), HostStamp(any()));
    EXPECT_GE(m.error, Duration{});
    if (i % 1000 == 0) clock.restart();
  }
  EXPECT_GT(clock.resets(), 0U);
}

/// Pairing by the stamps of one clock: the bus's, PTP's, the host's.

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
