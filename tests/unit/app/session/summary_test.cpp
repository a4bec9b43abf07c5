#include "app/session/summary.hpp"

#include <cmath>
#include <memory>

#include "core/math/so3.hpp"
#include "tests/support/mentions.hpp"
#include "tests/support/parallel_rig.hpp"

namespace vergence::app {
namespace {

TEST(TimeHistogram, meanAndMaxAreExactAndPercentilesWithinTheirBin) {
  auto h = std::make_unique<TimeHistogram>();
  for (int i = 1; i <= 1000; ++i) h->add(0.01 * i);
  EXPECT_NEAR(h->mean(), 5.005, 1e-9);
  EXPECT_DOUBLE_EQ(h->max(), 10.0);
  for (const double q : {0.5, 0.99, 0.999})
    EXPECT_NEAR(h->percentile(q), 10.0 * q, 0.0026 * 10.0 * q) << q;
  EXPECT_LE(h->percentile(1.0), h->max());
}

SummaryInput input() {
  SummaryInput in{.skipped = 2,
                  .calibration = {.cameras = 2},
                  .memory = {{"a_bytes", 3}, {"b_bytes", 4}},
                  .configuration_hash = "0123"};
  in.calibration.T_camera_left[1].t = {-0.5, 0, 0};
  return in;
}

TEST(Summary, framesAreCountedAndMissingReferenceIsNull) {
  auto totals = std::make_unique<SessionTotals>();
  totals->read = 5, totals->ok = 3, totals->degraded = 1, totals->lost = 1;
  totals->estimate.add(8);
  for (int i = 0; i < 99; ++i) totals->stages[std::size_t(Stage::track)].add(1);
  totals->stages[std::size_t(Stage::track)].add(16);
  const auto json = summary_json(*totals, input());
  EXPECT_TRUE(json["metrics"].is_null());
  EXPECT_EQ(
      json["frames"],
      (nlohmann::ordered_json{
          {"read", 5}, {"posed", 4}, {"ok", 3}, {"degraded", 1}, {"lost", 1}, {"skipped", 2}}));
  EXPECT_EQ(json["timing_ms"]["mean"], 8.0);
  EXPECT_EQ(json["timing_ms"]["stage_distributions"].size(), json["timing_ms"]["stages"].size());
  const auto& track = json["timing_ms"]["stage_distributions"]["track"];
  // The tolerance is half a bin, and microseconds.
  EXPECT_NEAR(track["p50"], 1.0, 0.0035);
  EXPECT_EQ(track["max"], 16.0);
  EXPECT_EQ(json["memory"]["total_bytes"], 7);
  EXPECT_TRUE(json["calibration"]["rating"].is_null());
  EXPECT_TRUE(json["calibration"]["depth_error_percent"]["20"].is_null());
}

TEST(Summary, knownScaleIsFoundAndShortDriveHasNoLongSegments) {
  // A bent path of about 80 m, the estimate 2 % too long: one scale explains all of it.
  std::vector<StampedPose> estimate, reference;
  for (int i = 0; i <= 160; ++i) {
    StampedPose p{Stamp(i * 100'000'000LL), {}};
    const double angle = 0.005 * i;
    p.T_world_body = {exp_so3({0, angle, 0}),
                      {100 * (1 - std::cos(angle)), 0, 100 * std::sin(angle)}};
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
  EXPECT_TRUE(test::mentions(metrics.dump(), "\"segment_error_percent\":null"));
}

RigCalibration with_yaw_sigma(double sigma) {
  RigCalibration rig = test::parallel_rig(test::pinhole(640, 480, 1500), 0.1);
  rig.sigma_total[1] = {1e-9, sigma, 1e-9, 0, 1e-9, 1e-9};
  return rig;
}

TEST(Summary, aYawSigmaTellsTheDepthErrorAndTheWord) {
  // A yaw error σ moves the disparity by f σ (a narrow lens: the same everywhere), so σ_z/z = z
  // σ/b: at 20 m 200 σ.
  const std::array<std::pair<double, const char*>, 3> cases{
      {{8e-5, "good"}, {2e-4, "fair"}, {4e-4, "poor"}}};
  for (const auto& [sigma, word] : cases) {
    auto totals = std::make_unique<SessionTotals>();
    SummaryInput in = input();
    in.calibration = with_yaw_sigma(sigma);
    in.before = with_yaw_sigma(8e-5);
    const auto json = summary_json(*totals, in)["calibration"];
    EXPECT_EQ(json["rating"], word);
    EXPECT_EQ(json["initial"]["rating"], "good");
    for (const int z : {1, 5, 10, 20, 50})
      EXPECT_NEAR(json["depth_error_percent"][std::to_string(z)].get<double>(),
                  100 * z * sigma / 0.1, 0.03 * 100 * z * sigma / 0.1)
          << z;
  }
}

TEST(Summary, whatLimitsADepthIsNoiseOrIntrinsics) {
  auto totals = std::make_unique<SessionTotals>();
  SummaryInput in = input();
  in.calibration = with_yaw_sigma(2e-4);
  EXPECT_TRUE(summary_json(*totals, in)["calibration"]["limited_by"].is_null())
      << "without the noise's part nobody knows";
  in.calibration.sigma_noise[1] = in.calibration.sigma_total[1];
  EXPECT_EQ(summary_json(*totals, in)["calibration"]["limited_by"], "noise");
  // This is a quarter of the variance.
  in.calibration.sigma_noise[1][1] = 1e-4;
  EXPECT_EQ(summary_json(*totals, in)["calibration"]["limited_by"], "intrinsics");
}

TEST(Summary, errorsOfACalibrationAreInUnitsAndInSigmas) {
  auto totals = std::make_unique<SessionTotals>();
  SummaryInput in = input();
  in.calibration = with_yaw_sigma(1e-3);
  RigCalibration truth = in.calibration;
  const Vec3 turn(0.001, -0.002, 0.003);
  in.calibration.T_camera_left[1].R = exp_so3(turn) * truth.T_camera_left[1].R;
  in.calibration.T_camera_left[1].t += Vec3(0, 0.004, 0);
  in.truth = TruthMetrics{std::nullopt, calibration_errors(in.calibration, truth)};
  const auto json = summary_json(*totals, in)["truth"];
  ASSERT_EQ(json["calibration"].size(), 1U);
  const auto& camera = json["calibration"][0];
  for (std::size_t i = 0; i < 3; ++i)
    EXPECT_NEAR(camera["rotation_rad"][i].get<double>(), turn(static_cast<int>(i)), 1e-12);
  EXPECT_NEAR(camera["translation_m"][1].get<double>(), 0.004, 1e-15);
  EXPECT_NEAR(camera["sigmas_total"][1].get<double>(), -2, 1e-9);
  EXPECT_TRUE(camera["sigmas_total"][3].is_null()) << "held: no sigma";
  EXPECT_TRUE(camera["sigmas_noise"].is_null());
  EXPECT_NEAR(json["calibration_error"][2].get<double>(), 0.003, 1e-12);
}

}  // namespace
}  // namespace vergence::app
