#include "core/calibration/monitor.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <limits>
#include <string>

#include "tests/unit/core/calibration/monitor_trial.hpp"

namespace vergence::test {
namespace {

using namespace calibration;
using Kind = MonitorResult::Kind;

// The rig changes after ten seconds.
constexpr int kBefore = 300;

FeatureDriveOptions street(double speed, std::uint64_t seed, int tracks = 220) {
  FeatureDriveOptions o{.speed = speed, .seed = seed};
  o.tracks = tracks;
  return o;
}

struct KnockRow {
  const char* name;
  Vec3 rotation_deg, translation_mm;
  // Maximum number of moving frames until detection.
  int limit;
};

/// A recalibration that starts at the onset must hold next to nothing of the old rig: 10 of the 60
/// frames it wants. Past frames are kept one by one for the last 64, and before that in blocks of
/// 15 (ChangeDetector): an onset that is found so late is the nearest block's first frame, or one
/// block's beside it.
bool onset_fits(std::uint64_t onset, int frames_since) {
  constexpr int kOneByOne = 64, kBlock = 15;
  const int late = static_cast<int>(onset) - kBefore;
  return frames_since > kOneByOne ? std::abs(late - 1) <= kBlock : late >= -10 && late <= kBlock;
}

class MonitorKnock : public testing::TestWithParam<KnockRow> {};

TEST_P(MonitorKnock, knockIsDetectedInTimeWithItsOnset) {
  const KnockRow& row = GetParam();
  int misplaced = 0;
  for (const double speed : {3.0, 8.0, 15.0}) {
    for (const std::uint64_t seed : {1U, 2U, 3U, 4U}) {
      SCOPED_TRACE(testing::Message() << row.name << " at " << speed << " m/s, seed " << seed);
      FeatureDriveOptions o = street(speed, seed);
      o.changes = {{kBefore, row.rotation_deg / kRadian, row.translation_mm * 1e-3, 0}};
      const TrialReference reference = calibrated(o);
      MonitorTrial trial(o, reference.T_right_left, reference.covariance);
      for (int i = 0; i < kBefore; ++i) ASSERT_EQ(trial.step().kind, Kind::quiet) << "frame " << i;
      ASSERT_GE(trial.frame().found_stereo, 190);
      const auto frames = trial.frames_until(row.limit);
      ASSERT_TRUE(frames.has_value()) << "statistic " << trial.verdict().statistic;
      for (int i = 0; i < 10; ++i) (void)trial.step();
      misplaced += !onset_fits(trial.verdict().onset_frame, *frames + 10) ? 1 : 0;
    }
  }
  // A window that happens to explain the past better than the truth: 1 of 120 knocks of t_z.
  EXPECT_LE(misplaced, 1);
}

INSTANTIATE_TEST_SUITE_P(Table, MonitorKnock,
                         testing::Values(KnockRow{"pitch_0_2_deg", {0.2, 0, 0}, {0, 0, 0}, 10},
                                         KnockRow{"pitch_0_05_deg", {-0.05, 0, 0}, {0, 0, 0}, 30},
                                         KnockRow{"roll_0_1_deg", {0, 0, 0.1}, {0, 0, 0}, 30},
                                         KnockRow{"t_y_4_mm", {0, 0, 0}, {0, 4, 0}, 30},
                                         KnockRow{"t_z_10_mm", {0, 0, 0}, {0, 0, 10}, 150},
                                         KnockRow{"pitch_2_deg", {2, 0, 0}, {0, 0, 0}, 10}),
                         [](const auto& row) { return std::string(row.param.name); });

TEST(Monitor, evidenceStatesTheShiftOfAPitch) {
  for (const double degrees : {0.03, 0.1}) {
    FeatureDriveOptions o = street(8, 5, 300);
    o.changes = {{150, Vec3(degrees, 0, 0) / kRadian, Vec3::Zero(), 0}};
    MonitorTrial trial(o);
    for (int i = 0; i < 300; ++i) (void)trial.step();
    ASSERT_EQ(trial.verdict().kind, Kind::knock);
    const ChangeEvidence& e = trial.verdict().evidence;
    // Rows move by f tan(pitch), a little more towards the corners; 0.003° are its noise here.
    EXPECT_NEAR(e.rotation_mrad, 1e3 * degrees / kRadian, 0.05 + 0.1 * 1e3 * degrees / kRadian);
    EXPECT_NEAR(e.shift_px, 1e-3 * e.rotation_mrad * o.right.fx, 1e-9);
    EXPECT_GT(2 * e.log_likelihood_ratio, MonitorOptions{}.threshold);
  }
}

TEST(Monitor, slowRotationIsDriftBefore0_03Degrees) {
  // The rates are in degrees per minute.
  for (const double rate : {0.02, -0.02}) {
    FeatureDriveOptions o = street(8, 2);
    o.changes = {{kBefore, Vec3(10 * rate, 0, 0) / kRadian, Vec3::Zero(), 18000}};
    const TrialReference reference = calibrated(o);
    MonitorTrial trial(o, reference.T_right_left, reference.covariance);
    for (int i = 0; i < kBefore; ++i) ASSERT_EQ(trial.step().kind, Kind::quiet);
    // The limit corresponds to 0.03°.
    const auto frames = trial.frames_until(2700);
    ASSERT_TRUE(frames.has_value());
    const auto as_drift = trial.verdict().kind == Kind::drift
                              ? frames
                              : trial.frames_until(2700 - *frames, Kind::drift);
    EXPECT_TRUE(as_drift.has_value());
  }
}

TEST(Monitor, unchangedRigIsQuietDrivingAndStanding) {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    FeatureDriveOptions o = street(8, seed, 300);
    o.drive_s = 40;
    o.stop_s = 20;
    o.outliers = 0.1;
    const TrialReference reference = calibrated(o);
    MonitorTrial trial(o, reference.T_right_left, reference.covariance);
    int standing = 0;
    for (int i = 0; i < 2 * 60 * 30; ++i) {
      ASSERT_EQ(trial.step().kind, Kind::quiet)
          << "frame " << i << ", statistic " << trial.verdict().statistic;
      standing += trial.frame().moving ? 0 : 1;
    }
    EXPECT_GT(standing, 900);
  }
}

TEST(Monitor, knockOfAStandingRigIsDetected) {
  FeatureDriveOptions o = street(8, 6, 300);
  o.drive_s = 10;
  o.stop_s = 60;
  o.changes = {{900, Vec3(0.2, 0, 0) / kRadian, Vec3::Zero(), 0}};
  MonitorTrial trial(o);
  for (int i = 0; i < 900; ++i) ASSERT_EQ(trial.step().kind, Kind::quiet);
  ASSERT_FALSE(trial.frame().moving);
  EXPECT_TRUE(trial.frames_until(10, Kind::knock).has_value());
  EXPECT_EQ(trial.verdict().onset_frame, 900U);
}

TEST(Monitor, doubledNoiseIsQuiet) {
  FeatureDriveOptions quiet = street(8, 7, 300);
  MonitorTrial trial(quiet);
  for (int i = 0; i < 300; ++i) (void)trial.step();
  FeatureDriveOptions rain = quiet;
  rain.white_px = 0.6, rain.constant_px = 0.6, rain.walk_px = 0.2;
  FeatureDrive drive(rain);
  for (int i = 0; i < 300; ++i) drive.next();
  for (int i = 0; i < 300; ++i) {
    drive.next();
    ASSERT_EQ(trial.show(drive).kind, Kind::quiet)
        << "frame " << i << ", statistic " << trial.verdict().statistic;
  }
}

TEST(Monitor, collapseNeedsExpectedMatches) {
  MonitorTrial trial(street(8, 8));
  for (int i = 0; i < 60; ++i) (void)trial.step();
  calibration::MonitorFrame night;
  for (std::uint64_t i = 60; i < 120; ++i) {
    night.frame = i;
    const MonitorResult v = trial.monitor().update(night);
    ASSERT_EQ(v.kind, Kind::quiet);
  }
  night.expected_stereo = 200;
  // A dark frame in between neither counts nor clears.
  calibration::MonitorFrame dark;
  dark.frame = night.frame;
  for (int i = 0; i < 4; ++i) {
    EXPECT_EQ(trial.monitor().update(night).kind, Kind::quiet);
    EXPECT_EQ(trial.monitor().update(dark).kind, Kind::quiet);
  }
  EXPECT_EQ(trial.monitor().update(night).kind, Kind::collapse);
}

TEST(Monitor, tooFewTracksAreNoEvidence) {
  MonitorTrial trial(street(8, 9, 20));
  for (int i = 0; i < 60; ++i) EXPECT_EQ(trial.step().statistic, 0);
}

TEST(Monitor, nonFiniteMatchesAreIgnored) {
  MonitorTrial clean(street(8, 10)), dirty(street(8, 10));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  dirty.spoil = [nan](std::vector<calibration::StereoObservation>& observations) {
    observations.push_back({{nan, 1}, {2, 3}, 0.5, 4'000'000'001U});
    observations.push_back(
        {{10, 1}, {2, std::numeric_limits<double>::infinity()}, 0.5, 4'000'000'002U});
    observations.push_back({{10, 1}, {2, 3}, 0, 4'000'000'003U});
    observations.push_back({{10, 1}, {2, 3}, nan, 4'000'000'004U});
  };
  for (int i = 0; i < 60; ++i) {
    (void)clean.step();
    (void)dirty.step();
  }
  EXPECT_EQ(clean.verdict().statistic, dirty.verdict().statistic);
  EXPECT_EQ(dirty.verdict().kind, Kind::quiet);
}

TEST(Monitor, invalidReferenceIsRefused) {
  MonitorTrial trial(street(8, 12));
  const Pinhole k{1247, 1247, 511.5, 383.5};
  EXPECT_FALSE(trial.monitor().set_reference({Transform{}, k, k}, Mat6::Zero()));
  EXPECT_EQ(trial.step().kind, Kind::quiet);
}

}  // namespace
}  // namespace vergence::test
