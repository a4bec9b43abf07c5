#include "app/recorder/summary.hpp"

#include <cmath>
#include <numbers>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "app/runtime/version.hpp"

namespace vergence::app {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kPercent = 100.0;
constexpr double kDegrees = 180.0 / std::numbers::pi;

/// Times to the microsecond: what is behind it is the clock's noise.
double ms(double value) { return std::round(value * 1e3) / 1e3; }

Json timing_json(const SessionTotals& t) {
  Json stages = {{"decode", ms(t.decode.mean())}};
  for (std::size_t i = 0; i < t.stages.size(); ++i) stages[std::string(to_string(static_cast<Stage>(i)))] = ms(t.stages[i].mean());
  return {{"mean", ms(t.estimate.mean())},
          {"p50", ms(t.estimate.percentile(0.5))},
          {"p99", ms(t.estimate.percentile(0.99))},
          {"p99_9", ms(t.estimate.percentile(0.999))},
          {"max", ms(t.estimate.max())},
          {"stages", stages}};
}

Json metrics_json(const std::optional<TrajectoryEvaluation>& evaluation) {
  if (!evaluation || evaluation->status != EvaluationStatus::ok) return nullptr;
  const TrajectoryEvaluation& e = *evaluation;
  const SegmentErrors &far = e.segments[0], &near = e.segments[1], &scaled = e.segments[2];
  return {{"matched", e.matched},
          {"path_m", e.path_reference},
          {"ate_m", e.ate_se3.rmse},
          {"ate_sim3_m", e.ate_sim3.rmse},
          {"scale", e.sim3.scale},
          {"path_ratio", e.path_ratio},
          {"segment_error_percent", far.translation * kPercent},
          {"segment_error_short_percent", near.translation * kPercent},
          {"segment_error_scaled_percent", scaled.translation * kPercent},
          {"rotation_error_deg_per_m", (far.count > 0 ? far.rotation : near.rotation) * kDegrees},
          {"end_error_percent", e.end_error_ratio * kPercent}};
}

/// METHOD §3: what the predicted depth error at 20 m says about the rig's health.
const char* health_word(double error_at_20_m) {
  constexpr double kGood = 0.02, kUsable = 0.05;
  return error_at_20_m <= kGood ? "good" : error_at_20_m <= kUsable ? "can be improved" : "recalibrate";
}

bool given(const std::array<double, 6>& sigmas) {
  for (const double s : sigmas)
    if (s > 0) return true;
  return false;
}

Json calibration_json(const RigCalibration& rig, const std::string& source) {
  const Transform& T = rig.T_camera_left[1];
  Json matrix = Json::array();
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) matrix.push_back(T.R(row, column));
    matrix.push_back(T.t(row));
  }
  Json depth = Json::object(), word;
  for (const int z : {1, 5, 10, 20, 50}) {
    const auto error = depth_error(rig, z);
    depth[std::to_string(z)] = error ? Json(*error * kPercent) : Json();
    if (z == 20 && error) word = health_word(*error);
  }
  return {{"source", source},
          {"baseline_m", T.t.norm()},
          {"T_right_left", matrix},
          {"sigma_noise", given(rig.sigma_noise[1]) ? Json(rig.sigma_noise[1]) : Json()},
          {"sigma_wide", given(rig.sigma_wide[1]) ? Json(rig.sigma_wide[1]) : Json()},
          {"word", word},
          {"depth_error_percent", depth}};
}

/// Null where nothing was counted.
Json counters_json(const std::vector<std::pair<std::string, std::uint64_t>>& counters) {
  Json json;
  for (const auto& [name, count] : counters) json[name] = count;
  return json;
}

Json truth_json(const std::optional<TruthFigures>& truth, const RigCalibration& rig) {
  if (!truth) return nullptr;
  Json json = metrics_json(truth->evaluation);
  if (json.is_null()) json = Json::object();
  Json in_sigmas;
  if (given(rig.sigma_wide[1])) {
    in_sigmas = Json::array();
    for (std::size_t i = 0; i < 6; ++i) in_sigmas.push_back(truth->calibration_error[i] / rig.sigma_wide[1][i]);
  }
  json["calibration_error"] = truth->calibration_error;
  json["calibration_error_sigmas"] = in_sigmas;
  return json;
}

}  // namespace

EvaluationOptions summary_evaluation_options() {
  EvaluationOptions options;
  const std::vector<double> near{10, 20, 30, 40, 50};  // m
  options.segments = {SegmentOptions{}, {near, 1, false}, {near, 1, true}};
  return options;
}

std::optional<double> depth_error(const RigCalibration& rig, double z) {
  const auto& sigma = rig.sigma_wide[1];
  const double baseline = rig.T_camera_left[1].t.norm();
  if (!given(sigma) || !(baseline > 0)) return std::nullopt;
  return std::hypot(z * sigma[1] / baseline, sigma[3] / baseline);
}

Json summary_json(const SessionTotals& totals, const SummaryInput& input) {
  Json json;
  json["frames"] = {{"read", totals.read}, {"posed", totals.ok + totals.degraded},
                    {"ok", totals.ok},     {"degraded", totals.degraded},
                    {"lost", totals.lost}, {"skipped", input.skipped}};
  json["path_m"] = totals.path_m;
  json["timing_ms"] = timing_json(totals);
  json["metrics"] = metrics_json(input.evaluation);
  json["calibration"] = calibration_json(input.calibration, input.calibration_source);
  json["recalibrations"] = Json::array();
  json["allocations_after_seal"] = input.allocations_after_seal;
  Json memory = Json::object();
  std::size_t sum = 0;
  for (const auto& [what, bytes] : input.memory) {
    memory[what] = bytes;
    sum += bytes;
  }
  memory["sum_bytes"] = sum;
  json["memory"] = memory;
  json["drops"] = {{"frames", input.skipped},
                   {"estimator", input.dropped_by_estimator},
                   {"records", totals.dropped_records},
                   {"lines", totals.lost_lines},
                   {"recorder_high_water", totals.ring_high_water}};
  json["devices"] = counters_json(input.devices);
  json["comparison"] = counters_json(input.comparison);
  json["truth"] = truth_json(input.truth, input.calibration);
  json["version"] = std::string(version());
  json["configuration_hash"] = input.configuration_hash;
  return json;
}

}  // namespace vergence::app
