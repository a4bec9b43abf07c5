#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "tests/unit/drivers/sync/pulse_rules.hpp"

namespace vergence {
namespace {

using testing::PulseRig;
using testing::PulseRigOptions;

SyncOptions board() {
  SyncOptions o;
  o.mode = SyncMode::board;
  return o;
}

void expect_proven_within_a_second(PulseRigOptions o, std::uint64_t seed, double seconds,
                                   std::uint64_t acquisitions) {
  SCOPED_TRACE("seed " + std::to_string(seed));
  o.seed = seed;
  PulseRig rig(o, board());
  rig.run(seconds);
  EXPECT_EQ(rig.truth().wrong, 0U);
  EXPECT_LE(rig.truth().worst_acquisition_s, 1.0);
  EXPECT_GT(rig.truth().worst_acquisition_s, 0.0);
  EXPECT_EQ(rig.counters().acquisitions[0], acquisitions);
  EXPECT_EQ(rig.counters().acquisitions[1], acquisitions);
}

TEST(PulsePairing, tenHoursWithoutAWrongPairAndEveryLossUnderItsName) {
  testing::expect_ten_hours_right(1);
}

TEST(PulsePairing, isProvenWithinASecondAfterStartReconnectAndReboot) {
  for (std::uint64_t seed = 1; seed <= 40; ++seed)
    for (const double rate : {20.0, 30.0}) {
      PulseRigOptions o;
      o.rate_hz = rate;
      o.gone = {{1, 5, 7}, {0, 15.02, 16}};
      o.reboots = {10.01};
      expect_proven_within_a_second(o, seed, 20, 3);
    }
}

TEST(PulsePairing, isProvenWithinASecondAfterEveryCameraWasGoneForAFewPulses) {
  for (std::uint64_t seed = 1; seed <= 40; ++seed)
    for (const double seconds : {0.05, 0.1, 0.2, 0.3}) {
      PulseRigOptions o;
      o.rate_hz = 20;
      const double at = 3 + 0.0137 * static_cast<double>(seed);
      o.gone = {{0, at, at + seconds}, {1, at, at + seconds}};
      expect_proven_within_a_second(o, seed, 8, 2);
    }
}

}  // namespace
}  // namespace vergence
