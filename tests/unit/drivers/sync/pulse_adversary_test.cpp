

#include "tests/unit/drivers/sync/pulse_rules.hpp"

/// Whatever a rig does wrong, no pair is called verified that is not one; the rig knows which pulse
/// made which frame.
namespace vergence {
namespace {

using namespace testing;

PulseRigTruth run(const PulseRigOptions& o, double seconds, SyncCounters* counters = nullptr,
                  SyncOptions sync = board()) {
  PulseRig rig(o, sync);
  rig.run(seconds);
  if (counters != nullptr) *counters = rig.counters();
  EXPECT_EQ(rig.truth().broken, 0U);
  EXPECT_EQ(rig.truth().wrong, 0U);
  return rig.truth();
}

/// Sets of a good stretch that must have come out verified, whole.
void expect_mostly_complete(const PulseRigTruth& t, double least) {
  EXPECT_GE(static_cast<double>(t.complete), least * static_cast<double>(t.pulses));
}

struct Oddity {
  const char* name;
  void (*set)(PulseRigOptions*);
  std::uint64_t seeds = 1;
  Duration hold{};
};

TEST(PulseAdversary, unusualStartsAndDelaysShiftNoPair) {
  using O = PulseRigOptions;
  for (const Oddity& oddity : {
           Oddity{"a stale image in the buffers", [](O* o) { o->stale_first = true; }, 50},
           Oddity{"a first trigger that is ignored", [](O* o) { o->first_dropped = true; }},
           Oddity{"counters from 1", [](O* o) { o->counter_start = 1; }},
           Oddity{"counters that wrap", [](O* o) { o->counter_start = 0xFFFF'FFFF'FFFF'FFF0; }},
           Oddity{"20 ms late", [](O* o) { o->lag[1] = Duration::milliseconds(20); }, 1,
                  Duration::milliseconds(150)},
           Oddity{"a pulse late", [](O* o) { o->lag[1] = Duration::milliseconds(33); }, 1,
                  Duration::milliseconds(150)},
           Oddity{"90 ms late", [](O* o) { o->lag[1] = Duration::milliseconds(90); }, 1,
                  Duration::milliseconds(150)},
           Oddity{"bursts", [](O* o) { o->bursts = 0.1; }},
       })
    for (std::uint64_t seed = 1; seed <= oddity.seeds; ++seed) {
      SCOPED_TRACE(oddity.name);
      PulseRigOptions o{.seed = seed};
      oddity.set(&o);
      SyncOptions sync = board();
      if (oddity.hold > Duration{}) sync.hold = oddity.hold;
      SyncCounters c;
      expect_mostly_complete(run(o, 10, &c, sync), 0.9);
      EXPECT_EQ(c.unreported, 0U);
      EXPECT_TRUE(o.bursts == 0 || c.contradictions[0] + c.contradictions[1] == 0);
    }
}

TEST(PulseAdversary, missingReportsCostNoPair) {
  PulseRigOptions o{.unreported = 0.05};
  SyncCounters c;
  const PulseRigTruth t = run(o, 60, &c);
  expect_mostly_complete(t, 0.95);
  EXPECT_GT(c.unreported, 50U);
  EXPECT_EQ(c.unreported, t.unreported);
  EXPECT_EQ(t.outside, 0U) << "reckoned from the cameras' clocks, with a bound that holds";
  EXPECT_EQ(c.missed_trigger[0] + c.missed_trigger[1] + c.lost[0] + c.lost[1], 0U);
}

TEST(PulseAdversary, clockJumpReacquiresOnlyItsCamera) {
  for (const double seconds : {0.003, 1.0 / 30, 2.0 / 30, -1.0 / 30, 5.0, -5.0, 4294.967296}) {
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
      SCOPED_TRACE(std::to_string(seconds) + " s, seed " + std::to_string(seed));
      PulseRigOptions o{.seed = seed, .jumps = {{1, 5, seconds}}};
      SyncCounters c;
      const PulseRigTruth t = run(o, 10, &c);
      EXPECT_EQ(c.contradictions[0], 0U);
      EXPECT_GE(c.contradictions[1], 1U);
      EXPECT_LE(c.contradictions[1], 2U);
      EXPECT_EQ(c.acquisitions[0], 1U);
      EXPECT_GE(c.acquisitions[1], 2U);
      EXPECT_GE(t.sets + 40, t.pulses) << "the other camera goes on";
    }
  }
}

TEST(PulseAdversary, evenIntervalsVerifyOnlyByAPause) {
  PulseRigOptions o{.vary = Duration{}, .stale_first = true};
  {
    PulseRig rig(o, board());
    rig.pauses(false);
    rig.run(20);
    EXPECT_EQ(rig.truth().sets, 0U) << "nothing is verified, nothing goes out";
    EXPECT_GT(rig.counters().acquiring[0], 500U);
  }
  PulseRig rig(o, board());
  rig.run(20);
  EXPECT_EQ(rig.truth().wrong, 0U);
  EXPECT_EQ(rig.asked(), 1);
  expect_mostly_complete(rig.truth(), 0.9);
  EXPECT_LE(rig.truth().worst_acquisition_s, 2.0);
  EXPECT_EQ(rig.counters().missed_trigger[0] + rig.counters().missed, 0U)
      << "what was left out was not missed";
}

TEST(PulseAdversary, hostStampsAreVerifiedByAPause) {
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    PulseRigOptions o{.seed = seed, .lost = 0.002, .missed = 0.002, .stamp_noise_us = 1500};
    SyncOptions sync = board();
    for (SyncCameraOptions& c : sync.camera) c.jitter = Duration::microseconds(1600);
    PulseRig rig(o, sync);
    rig.run(60);
    EXPECT_EQ(rig.truth().wrong, 0U);
    EXPECT_GE(rig.asked(), 1);
    expect_mostly_complete(rig.truth(), 0.8);
    for (std::size_t k = 0; k < 2; ++k) {
      EXPECT_EQ(rig.counters().missed_trigger[k], rig.truth().missed[k]);
      EXPECT_EQ(rig.counters().lost[k], rig.truth().lost[k]);
    }
  }
}

TEST(PulseAdversary, noWrongPairIsVerified) {
  for (std::uint64_t seed = 1; seed <= 60; ++seed) testing::expect_never_wrong(seed, 60);
}

TEST(PulsePairing, tenHoursGiveNoWrongPairAndCountLosses) { testing::expect_ten_hours_right(1); }

TEST(PulsePairing, isVerifiedWithinASecondAfterBriefLoss) {
  for (std::uint64_t seed = 1; seed <= 40; ++seed)
    for (const double seconds : {0.05, 0.1, 0.2, 0.3}) {
      PulseRigOptions o{.rate_hz = 20, .seed = seed};
      const double at = 3 + 0.0137 * static_cast<double>(seed);
      o.outages = {{0, at, at + seconds}, {1, at, at + seconds}};
      SCOPED_TRACE("seed " + std::to_string(seed));
      PulseRig rig(o, board());
      rig.run(8);
      EXPECT_EQ(rig.truth().wrong, 0U);
      EXPECT_LE(rig.truth().worst_acquisition_s, 1.0);
      EXPECT_GT(rig.truth().worst_acquisition_s, 0.0);
      for (const std::size_t k : {0U, 1U}) EXPECT_EQ(rig.counters().acquisitions[k], 2U);
    }
}

}  // namespace
}  // namespace vergence
