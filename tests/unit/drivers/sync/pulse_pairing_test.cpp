#include <gtest/gtest.h>

#include <string>

#include "tests/unit/drivers/sync/pulse_rig.hpp"

namespace vergence {
namespace {

using testing::PulseRig;
using testing::PulseRigOptions;

SyncOptions board() {
  SyncOptions o;
  o.mode = SyncMode::board;
  return o;
}

/// Ten hours at 30 Hz: 0.1 % of the frames lost, 0.05 % of the triggers missed, five reconnects, three reboots.
PulseRigOptions ten_hours(std::uint64_t seed) {
  PulseRigOptions o;
  o.seed = seed;
  o.lost = 1e-3;
  o.missed = 5e-4;
  Random random(seed, 3);
  for (int i = 0; i < 5; ++i) {
    const double at = 600 + 7000.0 * i + random.uniform(0, 3000);
    o.gone.push_back({static_cast<int>(random.below(2)), at, at + random.uniform(1, 20)});
  }
  for (int i = 0; i < 3; ++i) o.reboots.push_back(4500 + 9000.0 * i + random.uniform(0, 1000));
  return o;
}

void expect_ten_hours_right(std::uint64_t seed) {
  SCOPED_TRACE("seed " + std::to_string(seed));
  const PulseRigOptions o = ten_hours(seed);
  PulseRig rig(o, board());
  rig.run(36'000);
  const auto& t = rig.truth();
  const SyncCounters c = rig.counters();
  EXPECT_GT(t.pulses, 1'079'000U);
  EXPECT_EQ(t.wrong, 0U);
  EXPECT_EQ(t.unproven, 0U);
  EXPECT_EQ(c.reboots, 3U);
  std::array<std::uint64_t, 2> acquisitions{4, 4};
  for (const auto& g : o.gone) ++acquisitions[static_cast<std::size_t>(g.camera)];
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

TEST(PulsePairing, tenHoursWithoutAWrongPairAndEveryLossUnderItsName) { expect_ten_hours_right(1); }

struct Acquisition : ::testing::TestWithParam<double> {};

TEST_P(Acquisition, isProvenWithinASecondAfterStartReconnectAndReboot) {
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    PulseRigOptions o;
    o.seed = seed;
    o.rate_hz = GetParam();
    o.gone = {{1, 5, 7}, {0, 15.02, 16}};
    o.reboots = {10.01};
    PulseRig rig(o, board());
    rig.run(20);
    EXPECT_EQ(rig.truth().wrong, 0U);
    EXPECT_LE(rig.truth().worst_acquisition_s, 1.0);
    EXPECT_GT(rig.truth().worst_acquisition_s, 0.0);
    EXPECT_EQ(rig.counters().acquisitions[0], 3U);
    EXPECT_EQ(rig.counters().acquisitions[1], 3U);
  }
}

INSTANTIATE_TEST_SUITE_P(Rates, Acquisition, ::testing::Values(20.0, 30.0));

}  // namespace
}  // namespace vergence
