#pragma once
#include <gtest/gtest.h>

#include <initializer_list>
#include <string>

#include "tests/unit/drivers/sync/pulse_rig.hpp"

/// Properties for every seed: a few in the ordinary tests, many in the slow ones.
namespace vergence::testing {

inline SyncOptions board() { return {.mode = SyncMode::board}; }

/// Ten hours at 30 Hz: 0.1 % of the frames lost, 0.05 % of the triggers missed, five reconnects,
/// three reboots.
inline PulseRigOptions ten_hours(std::uint64_t seed) {
  PulseRigOptions o{.seed = seed, .lost = 1e-3, .missed = 5e-4};
  Random random(seed, 3);
  for (int i = 0; i < 5; ++i) {
    const double at = 600 + 7000.0 * i + random.uniform(0, 3000);
    o.outages.push_back({static_cast<int>(random.below(2)), at, at + random.uniform(1, 20)});
  }
  for (int i = 0; i < 3; ++i) o.reboots.push_back(4500 + 9000.0 * i + random.uniform(0, 1000));
  return o;
}

inline void expect_ten_hours_right(std::uint64_t seed) {
  SCOPED_TRACE("seed " + std::to_string(seed));
  const PulseRigOptions o = ten_hours(seed);
  PulseRig rig(o, board());
  rig.run(36'000);
  const auto& t = rig.truth();
  const SyncCounters c = rig.counters();
  EXPECT_GT(t.pulses, 1'079'000U);
  EXPECT_EQ(t.wrong, 0U);
  EXPECT_EQ(t.outside, 0U);
  // After a missed trigger sets may be in doubt for some frames.
  EXPECT_LE(t.ambiguous, 2 * (t.missed[0] + t.missed[1]));
  EXPECT_EQ(c.reboots, 3U);
  std::array<std::uint64_t, 2> acquisitions{4, 4};
  for (const auto& g : o.outages) ++acquisitions[static_cast<std::size_t>(g.camera)];
  for (std::size_t k = 0; k < 2; ++k) {
    EXPECT_EQ(c.lost[k], t.lost[k]) << k;
    EXPECT_EQ(c.missed_trigger[k], t.missed[k]) << k;
    EXPECT_EQ(c.contradictions[k], 0U) << k;
    EXPECT_EQ(c.duplicate[k] + c.late[k], 0U) << k;
    EXPECT_EQ(c.acquisitions[k], acquisitions[k]) << k;
    EXPECT_GT(t.lost[k], 900U);
    EXPECT_GT(t.missed[k], 400U);
  }
  EXPECT_EQ(c.unreported, 0U);
  EXPECT_LE(t.worst_acquisition_s, 1.0);
}

/// Everything at once, at random; nothing is spared around restarts.
inline void expect_never_wrong(std::uint64_t seed, double seconds) {
  SCOPED_TRACE("seed " + std::to_string(seed));
  Random random(seed, 11);
  const auto often = [&](std::initializer_list<double> values) {
    return values.begin()[random.below(static_cast<std::uint32_t>(values.size()))];
  };
  PulseRigOptions o{.rate_hz = often({15, 20, 25, 30, 60}),
                    .vary = Duration::seconds(often({0, 0.0005, 0.001, 0.002})),
                    .cameras = 2 + static_cast<int>(random.below(3)),
                    .seed = seed};
  o.lost = often({0, 0.001, 0.02, 0.1});
  o.unreported = often({0, 0.001, 0.02, 0.1});
  o.duplicated = often({0, 0.02, 0.2});
  o.bursts = often({0, 0, 0.05, 0.3});
  o.frame_jitter_ms = often({0.5, 2, 15});
  o.stamp_noise_us = often({1, 10, 300});
  // Where only a pause proves, a camera that often misses as many in a row as a pause leaves out
  // could be mistaken.
  const bool varied = o.vary.to_seconds() > o.stamp_noise_us * 8e-6;
  o.missed = varied ? often({0, 0.001, 0.02, 0.1}) : often({0, 0.001, 0.02});
  o.stale_first = random.below(2) == 0;
  o.first_dropped = random.below(2) == 0;
  o.counter_start = random.below(3);
  o.lag[1] = Duration::seconds(often({0, 0, 0.02, 1 / o.rate_hz, 2.5 / o.rate_hz}));
  o.quiet = 0;
  for (double at = 4; at + 8 < seconds; at += random.uniform(1, 9)) {
    const int camera = static_cast<int>(random.below(static_cast<std::uint32_t>(o.cameras)));
    switch (random.below(3)) {
      case 0:
        o.outages.push_back({camera, at, at + random.uniform(0.05, 3)});
        break;
      case 1:
        o.reboots.push_back(at);
        break;
      default:
        o.jumps.push_back({camera, at,
                           random.below(2) == 0 ? random.uniform(-3, 3)
                                                : (random.uniform() < 0.5 ? 1 : -2) / o.rate_hz});
    }
  }
  SyncOptions sync = board();
  for (SyncCameraOptions& c : sync.camera) c.jitter = Duration::seconds(o.stamp_noise_us * 2e-6);
  PulseRig rig(o, sync);
  rig.run(seconds);
  EXPECT_EQ(rig.truth().broken, 0U);
  EXPECT_EQ(rig.truth().wrong, 0U);
  EXPECT_EQ(rig.truth().outside, 0U);
}

}  // namespace vergence::testing
