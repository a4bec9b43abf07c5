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

TEST(PulsePairing, tenHoursWithoutAWrongPairAndEveryLossUnderItsName) {
  testing::expect_ten_hours_right(1);
}

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

TEST(PulsePairing, isProvenWithinASecondAfterEveryCameraWasGoneForAFewPulses) {
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    for (const double seconds : {0.05, 0.1, 0.2, 0.3}) {
      SCOPED_TRACE("seed " + std::to_string(seed) + ", gone for " + std::to_string(seconds) + " s");
      PulseRigOptions o;
      o.seed = seed;
      o.rate_hz = 20;
      const double at = 3 + 0.0137 * static_cast<double>(seed);
      o.gone = {{0, at, at + seconds}, {1, at, at + seconds}};
      PulseRig rig(o, board());
      rig.run(8);
      EXPECT_EQ(rig.truth().wrong, 0U);
      EXPECT_LE(rig.truth().worst_acquisition_s, 1.0);
      EXPECT_EQ(rig.counters().acquisitions[0], 2U);
      EXPECT_EQ(rig.counters().acquisitions[1], 2U);
    }
  }
}

/// 99 of a hundred errors are below, in size.
double p99(std::vector<double> errors) {
  for (double& e : errors) e = std::abs(e);
  std::sort(errors.begin(), errors.end());
  return errors[errors.size() * 99 / 100];
}

double rms(const std::vector<double>& errors) {
  double sum = 0;
  for (const double e : errors) sum += e * e;
  return std::sqrt(sum / static_cast<double>(errors.size()));
}

/// Over a line with a jitter of 2 ms: ten seconds of pings, or thirty of reports alone.
void expect_exact_stamps(PulseRigOptions::Clock clock, double settle) {
  std::vector<double> errors;
  std::uint64_t outside = 0;
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    PulseRigOptions o;
    o.seed = seed;
    o.clock = clock;
    o.report_jitter_ms = 2;
    o.report_delay = Duration::microseconds(300);
    o.feedback = true;
    o.settle = settle;
    PulseRig rig(o, board());
    rig.keep_errors();
    rig.run(settle + 10);
    EXPECT_EQ(rig.truth().wrong, 0U);
    outside += rig.truth().outside;
    errors.insert(errors.end(), rig.truth().stamp_errors_us.begin(),
                  rig.truth().stamp_errors_us.end());
  }
  ASSERT_GT(errors.size(), 15'000U);
  EXPECT_LE(rms(errors), 20);
  EXPECT_LE(p99(errors), 50);
  EXPECT_LE(outside, errors.size() / 1000);
}

TEST(RigStamps, areTwentyMicrosecondsFromTheTruthAfterTenSecondsOfPings) {
  expect_exact_stamps(PulseRigOptions::Clock::pings, 10);
}

TEST(RigStamps, areTwentyMicrosecondsFromTheTruthAfterThirtySecondsOfReports) {
  expect_exact_stamps(PulseRigOptions::Clock::arrivals, 30);
}

}  // namespace
}  // namespace vergence
