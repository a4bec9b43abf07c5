
#include <string>
#include <utility>

#include "core/math/random.hpp"
#include "core/memory/allocation_guard.hpp"
#include "drivers/sync/sync_out_pulses.hpp"
#include "firmware_iface/trigger/trigger.h"
#include "tests/unit/drivers/sync/rig_frames.hpp"

/// The modes with other pulses than a board's: the INS's, those of one camera that triggers the
/// others; and what all with pulses share.
namespace vergence {
namespace {

using namespace testing;

// ---- the INS's SyncOut ----

/// Cameras triggered by an INS at 100 Hz that sends a pulse every fourth sample. Even intervals:
/// only a gap proves.
TEST(RigModes, syncOutIsVerifiedByAnInitialPause) {
  SyncOptions o = rig_options(SyncMode::ins_syncout);
  RigSynchronizer sync(o);
  SyncOutPulses pulses(kRigInterval);
  RigSets out;
  std::array<std::uint64_t, 2> counters{3, 900};
  HostStamp t(50'000'000'000);
  int pulse = 0;
  bool asked = false;
  for (int sample = 0; sample < 4000; ++sample, t = t + kRigInterval / 4) {
    if (sync.wants_pause() > 0) {
      EXPECT_FALSE(asked);
      asked = true;
      while (sample % 4 != 0) ++sample;
      // The pause is GoToConfig and GoToMeasurement.
      t = t + Duration::microseconds(313'700);
      pulses.restart();
    }
    const bool pulsed = sample % 4 == 0;
    InsReading r{.measured = DeviceStamp(t.ns() + 123'456'789),
                 .arrival = t + Duration::milliseconds(4)};
    r.quality.sync_out = pulsed;
    // Some samples are lost.
    if (sample % 97 != 0 || sample < 8) {
      if (const auto p = pulses.reading(r, {t, Duration::microseconds(200)})) {
        EXPECT_TRUE(pulsed) << sample;
        sync.pulse(*p);
        out.drain(&sync);
      }
    }
    if (!pulsed) continue;
    for (int k = 0; k < 2; ++k) {
      const auto i = static_cast<std::size_t>(k);
      (void)out.offer(&sync, rig_frame(k, pulse, counters[i]++, t,
                                       DeviceStamp(t.ns() / (k + 1) * (k + 1) - 7'000'000 * k),
                                       Duration::milliseconds(9)));
    }
    ++pulse;
  }
  EXPECT_TRUE(asked);
  out.expect_pairs();
  EXPECT_GE(out.complete(), 900U);
  for (const SyncedSet& s : out.sets) {
    EXPECT_EQ(s.proof, SyncProof::numbered);
    EXPECT_LE(s.spread, Duration{});
  }
  EXPECT_EQ(sync.counters().missed_trigger[0] + sync.counters().missed_trigger[1], 0U);
  EXPECT_GT(sync.counters().unreported, 0U);
}

// ---- one camera triggers the other ----

struct MasterRig {
  explicit MasterRig(std::uint64_t seed)
      : sync(rig_options(SyncMode::master_strobe)), random(seed) {}

  void pulse() {
    const HostStamp start = HostStamp(9'000'000'000) + time;
    const bool lost0 = lose && random.uniform() < 0.01, lost1 = lose && random.uniform() < 0.01,
               missed1 = std::exchange(miss, false);
    lost[0] += lost0 ? 1 : 0;
    if (!lost0)
      offer(rig_frame(0, number, counters[0], start, DeviceStamp(start.ns() + 5'000'000'000)));
    ++counters[0];
    if (slave_here) {
      missed[1] += missed1 ? 1 : 0;
      if (!missed1) {
        lost[1] += lost1 ? 1 : 0;
        // 20 ppm faster.
        if (!lost1)
          offer(rig_frame(1, number, counters[1], start,
                          DeviceStamp(start.ns() + start.ns() / 50'000 - slave_offset)));
        ++counters[1];
      }
    }
    ++number;
    time = time + kRigInterval;
  }
  void offer(const SyncFrame& f) {
    (void)out.offer(&sync, f);
    if (sync.wants_pause() == 0) return;
    ++pauses;
    // The master is stopped and started: its count begins again, its clock goes on.
    time = time + Duration::microseconds(233'400);
    sync.absent(0);
    sync.restarted(0);
    // The pulse in progress increments the counter to 0.
    counters[0] = static_cast<std::uint64_t>(-1);
    out.drain(&sync);
  }

  RigSynchronizer sync;
  Random random;
  RigSets out;
  Duration time{};
  int number = 0, pauses = 0;
  std::array<std::uint64_t, 2> counters{}, lost{}, missed{};
  std::int64_t slave_offset = 777'000'000;
  bool slave_here = true, lose = false, miss = false;
};

TEST(RigModes, masterRestartVerifiesItsSlaves) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    MasterRig rig(seed);
    rig.counters = {0, 12};
    for (int i = 0; i < 200; ++i) rig.pulse();
    EXPECT_EQ(rig.pauses, 1);
    EXPECT_TRUE(rig.sync.verified(1));
    rig.lose = true;
    for (int i = 0; i < 1000; ++i) rig.pulse();
    rig.lose = false;
    for (int i = 0; i < 100; ++i) rig.pulse();
    EXPECT_EQ(rig.pauses, 1);
    EXPECT_EQ(rig.sync.counters().ambiguous, 0U);
    // At even intervals a trigger that is missed is in doubt until another gap.
    rig.miss = true;
    for (int i = 0; i < 100; ++i) rig.pulse();
    EXPECT_EQ(rig.pauses, 2);
    EXPECT_GT(rig.sync.counters().ambiguous, 5U);
    EXPECT_LT(rig.sync.counters().ambiguous, 30U);
    rig.sync.absent(1);
    rig.slave_here = false;
    for (int i = 0; i < 100; ++i) rig.pulse();
    rig.sync.restarted(1);
    rig.slave_here = true;
    rig.slave_offset = -123'456'789'000;
    rig.counters[1] = 1;
    const auto before = rig.sync.counters();
    for (int i = 0; i < 200; ++i) rig.pulse();
    rig.out.expect_pairs();
    const SyncCounters c = rig.sync.counters();
    EXPECT_EQ(c.acquisitions[1] - before.acquisitions[1], 1U);
    EXPECT_EQ(c.lost[0], rig.lost[0]);
    EXPECT_EQ(c.lost[1], rig.lost[1]);
    EXPECT_EQ(c.missed_trigger[1], rig.missed[1]);
    EXPECT_GT(rig.out.complete(), 1200U);
    for (const SyncedSet& s : rig.out.sets)
      EXPECT_TRUE(s.proof == SyncProof::master || s.proof == SyncProof::ambiguous);
  }
}

// ---- what all with pulses share ----

Pulse pulse_at(std::uint64_t number, HostStamp at) {
  return {.number = number,
          .edge = DeviceStamp(at.ns() - 70'000'000'000),
          .arrival = at + Duration::milliseconds(2),
          .mapped = true,
          .host = at,
          .host_error = Duration::microseconds(15)};
}

/// Varied by a millisecond, as the board does it.
Duration varied(std::uint64_t n) {
  return kRigInterval +
         Duration::milliseconds(trigger_interval_is_longer(static_cast<std::uint32_t>(n)) ? 1 : -1);
}

TEST(RigModes, setsShareTheMidExposureStamp) {
  SyncOptions o = rig_options(SyncMode::board);
  o.camera[0].delay = Duration::microseconds(30);
  RigSynchronizer sync(o);
  RigSets out;
  HostStamp t(80'000'000'000);
  std::vector<HostStamp> edges;
  for (std::uint64_t n = 0; n < 60; ++n) {
    Pulse p = pulse_at(n, t);
    if (n >= 40) p.exposure[0] = {true, Duration::microseconds(50), Duration::microseconds(4050)};
    edges.push_back(t);
    sync.pulse(p);
    out.drain(&sync);
    for (int k = 0; k < 2; ++k) {
      SyncFrame f =
          rig_frame(k, static_cast<int>(n), n, t, DeviceStamp(t.ns() + k * 1'000'000'000));
      if (k == 1) f.exposure = Duration::milliseconds(4);
      (void)out.offer(&sync, f);
    }
    t = t + varied(n);
  }
  ASSERT_GT(out.complete(), 35U);
  for (const SyncedSet& s : out.sets) {
    const HostStamp edge = edges[s.slots[0]];
    const bool measured = s.slots[0] >= 40;
    EXPECT_EQ(s.stamp - edge,
              measured ? Duration::microseconds(2050) : Duration::microseconds(3030));
    EXPECT_EQ(s.spread, measured ? Duration::microseconds(50) : Duration::microseconds(1030))
        << "unequal exposures";
    EXPECT_EQ(s.error, Duration::microseconds(15));
    EXPECT_TRUE(s.reported);
  }
}

TEST(RigModes, contradictingReportUnverifiesItsSet) {
  RigSynchronizer sync(rig_options(SyncMode::board));
  RigSets out;
  HostStamp t(80'000'000'000);
  for (std::uint64_t n = 0; n < 40; ++n) {
    sync.pulse(pulse_at(n, t));
    for (int k = 0; k < 2; ++k)
      (void)out.offer(&sync, rig_frame(k, static_cast<int>(n), n, t, DeviceStamp(t.ns())));
    t = t + varied(n);
  }
  ASSERT_TRUE(sync.verified(0) && sync.verified(1));
  // The frames come first; the report then says that the pulse went out 700 µs earlier than their
  // stamps do.
  for (int k = 0; k < 2; ++k) (void)out.offer(&sync, rig_frame(k, 40, 40, t, DeviceStamp(t.ns())));
  const std::size_t before = out.sets.size();
  sync.pulse(pulse_at(40, t - Duration::microseconds(700)));
  out.drain(&sync);
  ASSERT_EQ(out.sets.size(), before + 1);
  EXPECT_EQ(out.sets.back().proof, SyncProof::ambiguous);
  EXPECT_EQ(sync.counters().contradictions[0], 1U);
  EXPECT_EQ(sync.counters().contradictions[1], 1U);
  EXPECT_FALSE(sync.verified(0));
}

}  // namespace
}  // namespace vergence
