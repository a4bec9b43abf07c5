#include "app/recorder/summary.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include <nlohmann/json.hpp>

#include "app/recorder/histogram.hpp"

namespace vergence::app {
namespace {

TEST(TimeHistogram, meanAndMaxAreExactAndPercentilesWithinTheirBin) {
  auto h = std::make_unique<TimeHistogram>();
  for (int i = 1; i <= 1000; ++i) h->add(0.01 * i);
  EXPECT_NEAR(h->mean(), 5.005, 1e-9);
  EXPECT_DOUBLE_EQ(h->max(), 10.0);
  for (const double q : {0.5, 0.99, 0.999}) EXPECT_NEAR(h->percentile(q), 10.0 * q, 0.0026 * 10.0 * q) << q;
  EXPECT_LE(h->percentile(1.0), h->max());
}

TEST(TimeHistogram, extremesAndNonsenseAreHeld) {
  auto h = std::make_unique<TimeHistogram>();
  EXPECT_EQ(h->percentile(0.5), 0);
  EXPECT_EQ(h->mean(), 0);
  h->add(std::nan(""));
  h->add(-1);
  EXPECT_EQ(h->count(), 0U);
  h->add(0);
  h->add(1e12);
  EXPECT_EQ(h->count(), 2U);
  EXPECT_EQ(h->max(), 1e12);
  EXPECT_LE(h->percentile(0.5), 1.01e-3);
}

SummaryInput input() {
  SummaryInput in;
  in.calibration.cameras = 2;
  in.calibration.T_camera_left[1].t = {-0.5, 0, 0};
  in.memory = {{"a_bytes", 3}, {"b_bytes", 4}};
  in.skipped = 2;
  in.configuration_hash = "0123";
  return in;
}

TEST(Summary, hasTheKeysOfTheContractAndNullWhereThereIsNoReference) {
  auto totals = std::make_unique<SessionTotals>();
  totals->read = 5, totals->ok = 3, totals->degraded = 1, totals->lost = 1;
  totals->estimate.add(8);
  const auto json = summary_json(*totals, input());
  for (const char* key : {"frames", "timing_ms", "metrics", "calibration", "recalibrations", "allocations_after_seal", "memory", "drops",
                          "version", "configuration_hash"})
    EXPECT_TRUE(json.contains(key)) << key;
  EXPECT_TRUE(json["metrics"].is_null());
  EXPECT_EQ(json["frames"], (nlohmann::ordered_json{{"read", 5}, {"posed", 4}, {"ok", 3}, {"degraded", 1}, {"lost", 1}, {"skipped", 2}}));
  EXPECT_EQ(json["timing_ms"]["mean"], 8.0);
  for (const char* key : {"p50", "p99", "p99_9", "max"}) EXPECT_TRUE(json["timing_ms"].contains(key)) << key;
  for (const char* stage : {"decode", "pyramid", "detect", "track", "match", "pose", "window"})
    EXPECT_TRUE(json["timing_ms"]["stages"].contains(stage)) << stage;
  EXPECT_EQ(json["memory"]["sum_bytes"], 7);
  EXPECT_TRUE(json["calibration"]["word"].is_null());
  EXPECT_TRUE(json["calibration"]["depth_error_percent"]["20"].is_null());
}

TEST(Summary, metricsOfAKnownScaleComeOutAndLongSegmentsOfAShortDriveAreNull) {
  // A bent path of about 80 m, the estimate 2 % too long: one scale explains all of it.
  std::vector<StampedPose> estimate, reference;
  for (int i = 0; i <= 160; ++i) {
    StampedPose p{Stamp(i * 100'000'000LL), {}};
    const double angle = 0.005 * i;
    p.T_world_body = {exp_so3({0, angle, 0}), {100 * (1 - std::cos(angle)), 0, 100 * std::sin(angle)}};
    reference.push_back(p);
    p.T_world_body.t *= 1.02;
    estimate.push_back(p);
  }
  auto totals = std::make_unique<SessionTotals>();
  SummaryInput in = input();
  in.evaluation = evaluate(estimate, reference, summary_evaluation_options());
  const auto metrics = summary_json(*totals, in)["metrics"];
  EXPECT_NEAR(metrics["scale"].get<double>(), 1 / 1.02, 1e-12);
  EXPECT_NEAR(metrics["ate_sim3_m"].get<double>(), 0, 1e-9);
  EXPECT_NEAR(metrics["segment_error_scaled_percent"].get<double>(), 0, 1e-9);
  EXPECT_GT(metrics["segment_error_short_percent"].get<double>(), 1.9);
  EXPECT_NEAR(metrics["rotation_error_deg_per_m"].get<double>(), 0, 1e-9);
  EXPECT_NEAR(metrics["path_m"].get<double>(), 80, 0.01);
  EXPECT_NE(metrics.dump().find("\"segment_error_percent\":null"), std::string::npos) << metrics.dump();
}

TEST(Summary, aYawSigmaTellsTheDepthErrorAndTheWord) {
  auto totals = std::make_unique<SessionTotals>();
  SummaryInput in = input();
  in.calibration.sigma_wide[1] = {1e-4, 5e-4, 1e-4, 0, 0.001, 0.001};  // at 20 m: 20 · 0.5 mrad / 0.5 m = 2 %
  EXPECT_NEAR(*depth_error(in.calibration, 20), 0.02, 1e-12);
  in.calibration.sigma_wide[1][1] = 4e-4;
  EXPECT_EQ(summary_json(*totals, in)["calibration"]["word"], "good");
  in.calibration.sigma_wide[1][1] = 1e-3;
  EXPECT_EQ(summary_json(*totals, in)["calibration"]["word"], "can be improved");
  in.calibration.sigma_wide[1][1] = 2e-3;
  const auto json = summary_json(*totals, in);
  EXPECT_EQ(json["calibration"]["word"], "recalibrate");
  EXPECT_NEAR(json["calibration"]["depth_error_percent"]["50"].get<double>(), 20.0, 1e-9);
}

}  // namespace
}  // namespace vergence::app
