#include "app/session/summary.hpp"

#include "app/runtime/transform_rows.hpp"
#include "app/runtime/version.hpp"
#include "core/calibration/health.hpp"
#include "core/features/simd_target.hpp"
#include "core/math/angle.hpp"

namespace vergence::app {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kPercent = 100.0;

/// Times to the microsecond: what is behind it is the clock's noise.
double ms(double value) { return std::round(value * 1e3) / 1e3; }

Json timing_json(const SessionTotals& t) {
  Json stages = {{"decode", ms(t.decode.mean())}};
  Json of_stages = {{"decode", distribution_json(t.decode)}};
  for (std::size_t i = 0; i < t.stages.size(); ++i) {
    const std::string stage(to_string(static_cast<Stage>(i)));
    stages[stage] = ms(t.stages[i].mean());
    of_stages[stage] = distribution_json(t.stages[i]);
  }
  Json calibrating;
  if (t.calibrating.count() > 0)
    calibrating = {{"frames", t.calibrating.count()},
                   {"mean", ms(t.calibrating.mean())},
                   {"p99", ms(t.calibrating.percentile(0.99))},
                   {"max", ms(t.calibrating.max())}};
  Json json = {{"mean", ms(t.estimate.mean())}};
  json.update(distribution_json(t.estimate));
  json["while_calibrating"] = calibrating;
  json["stages"] = stages;
  json["stage_distributions"] = of_stages;
  return json;
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
          {"rotation_error_deg_per_m",
           (far.count > 0 ? far.rotation : near.rotation) * kDegreesPerRadian},
          {"end_error_percent", e.end_error_ratio * kPercent}};
}

bool given(const std::array<double, 6>& sigmas) {
  return std::ranges::any_of(sigmas, [](double s) { return s > 0; });
}

/// Returns true if every additional camera has sigmas; otherwise nothing can be predicted.
bool has_sigmas(const RigCalibration& rig) {
  for (std::size_t k = 1; k < static_cast<std::size_t>(rig.cameras); ++k)
    if (!given(rig.sigma_total[k]) && !(rig.covariance_total[k].diagonal().maxCoeff() > 0))
      return false;
  return rig.cameras > 1;
}

/// The word and the predicted depth errors, of the best pair at each depth; null where the
/// calibration brings no sigmas.
Json health_json(const RigCalibration& rig, const calibration::CalibrationOptions& options) {
  const bool known = has_sigmas(rig);
  Json depth = Json::object();
  for (const double z : calibration::kHealthDepths) {
    const double percent = known ? calibration::depth_error_percent(rig, z) : 0.0;
    // At 0 % the depth is so small that no point is visible in both cameras.
    depth[fmt::format("{:g}", z)] = percent > 0 ? Json(percent) : Json();
  }
  return {{"rating", known ? Json(calibration::rating(rig, options)) : Json()},
          {"depth_error_percent", depth}};
}

/// Main cause of the depth error at 20 m: the noise of the images that the calibration was
/// found from, which more driving lessens, or intrinsics that are not known better. Null without
/// sigmas.
Json limited_by(const RigCalibration& rig) {
  if (!has_sigmas(rig) || !given(rig.sigma_noise[1])) return nullptr;
  // Depth in m at which the limiting cause is determined.
  constexpr double kDepth = 20;
  RigCalibration noise = rig;
  // Without correlations the depth error is not smaller than the actual one.
  noise.sigma_total = rig.sigma_noise;
  for (Mat6& covariance : noise.covariance_total) covariance.setZero();
  noise.covariance = {};
  const double wide = calibration::depth_error_percent(rig, 1, kDepth),
               by_noise = calibration::depth_error_percent(noise, 1, kDepth);
  return by_noise * by_noise < 0.5 * wide * wide ? "intrinsics" : "noise";
}

Json sigmas_json(const std::array<double, 6>& sigmas) {
  return given(sigmas) ? Json(sigmas) : Json();
}

/// The attempt by which a drive from scratch found its first calibration.
Json from_scratch_json(const SessionTotals& totals) {
  const auto& [found, rejected] = totals.from_scratch;
  if (!found) return nullptr;
  return {{"stamp_ns", found->stamp.ns()},
          {"latency_frames", found->latency_frames},
          {"frames", found->frames},
          {"solve_ms", ms(found->solve_ms)},
          {"rejected_before", rejected}};
}

Json calibration_json(const SessionTotals& totals, const SummaryInput& input) {
  const RigCalibration& rig = input.calibration;
  Json json = {{"source", input.calibration_source},
               {"baseline_m", rig.T_camera_left[1].t.norm()},
               {"T_right_left", input.calibrated ? Json(rows_of(rig.T_camera_left[1])) : Json()},
               {"sigma_noise", sigmas_json(rig.sigma_noise[1])},
               {"sigma_total", sigmas_json(rig.sigma_total[1])},
               {"scale_sigma", rig.scale_sigma > 0 ? Json(rig.scale_sigma) : Json()},
               {"frames", rig.frames}};
  json.update(health_json(rig, input.options));
  json["limited_by"] = limited_by(rig);
  json["online"] = input.online;
  json["verified"] = input.verified;
  json["verified_frame"] = totals.verified_frame ? Json(*totals.verified_frame) : Json();
  json["verified_stamp_ns"] = totals.verified ? Json(totals.verified->ns()) : Json();
  json["contradicted"] = totals.contradicted
                             ? Json{{"stamp_ns", totals.contradicted->stamp.ns()},
                                    {"depth_percent", totals.contradicted->depth_percent}}
                             : Json();
  json["focal_length"] = totals.focal.measured_px > 0
                             ? Json{{"configured_px", totals.focal.configured_px},
                                    {"measured_px", totals.focal.measured_px},
                                    {"sigma_px", totals.focal.sigma_px},
                                    {"doubted", totals.focal.doubted},
                                    {"contradicted", totals.focal.contradicted}}
                             : Json();
  json["initial"] = input.before ? health_json(*input.before, input.options) : Json();
  json["from_scratch"] = from_scratch_json(totals);
  json["accepted"] = totals.accepted;
  json["rejected"] = totals.rejected;
  return json;
}

/// Results of alarms and requests; the first calibration of a drive from scratch is none of
/// them.
Json recalibrations_json(const SessionTotals& totals) {
  Json json = Json::array();
  for (const CalibrationAttempt& a : totals.attempts) {
    if (a.cause == "from_scratch") continue;
    json.push_back({{"reason", a.cause},
                    {"stamp_ns", a.stamp.ns()},
                    {"latency_frames", a.latency_frames},
                    {"accepted", a.accepted},
                    {"rejection_reason", a.accepted ? Json() : Json(a.reason)},
                    {"frames", a.frames},
                    {"solve_ms", ms(a.solve_ms)}});
  }
  return json;
}

/// Null where nothing was counted.
template <class Counters>
Json counters_json(const Counters& counters) {
  Json json;
  for (const auto& [name, count] : counters) json[name] = count;
  return json;
}

/// Errors over sigmas; null without sigmas. A sigma of zero is of a direction that was held: its
/// error is in no sigmas.
Json in_sigmas(const std::array<double, 6>& error, const std::array<double, 6>& sigmas) {
  if (!given(sigmas)) return nullptr;
  Json json = Json::array();
  for (std::size_t i = 0; i < 6; ++i)
    json.push_back(sigmas[i] > 0 ? Json(error[i] / sigmas[i]) : Json());
  return json;
}

Json truth_json(const std::optional<TruthMetrics>& truth, const SummaryInput& input) {
  if (!truth) return nullptr;
  const RigCalibration& rig = input.calibration;
  Json json = metrics_json(truth->evaluation);
  if (json.is_null()) json = Json::object();
  if (!input.calibrated || truth->calibration_error.empty()) {
    for (const char* key : {"calibration_error", "calibration_error_sigmas", "calibration"})
      json[key] = nullptr;
    return json;
  }
  json["calibration_error"] = truth->calibration_error[0];
  json["calibration_error_sigmas"] = in_sigmas(truth->calibration_error[0], rig.sigma_total[1]);
  Json cameras = Json::array();
  for (std::size_t k = 1; k <= truth->calibration_error.size(); ++k) {
    const auto& e = truth->calibration_error[k - 1];
    cameras.push_back({{"camera", k},
                       {"rotation_rad", {e[0], e[1], e[2]}},
                       {"translation_m", {e[3], e[4], e[5]}},
                       {"sigmas_noise", in_sigmas(e, rig.sigma_noise[k])},
                       {"sigmas_total", in_sigmas(e, rig.sigma_total[k])}});
  }
  json["calibration"] = cameras;
  return json;
}

}  // namespace

Json distribution_json(const TimeHistogram& times) {
  return {{"p50", ms(times.percentile(0.5))},
          {"p99", ms(times.percentile(0.99))},
          {"p99_9", ms(times.percentile(0.999))},
          {"max", ms(times.max())}};
}

EvaluationOptions summary_evaluation_options() {
  EvaluationOptions options;
  // Segment lengths in m.
  const std::vector<double> near{10, 20, 30, 40, 50};
  options.segments = {SegmentOptions{}, {near, 1, false}, {near, 1, true}};
  return options;
}

void print_evaluation(const char* reference, const std::optional<TrajectoryEvaluation>& evaluation,
                      Progress* progress) {
  if (!evaluation || evaluation->status != EvaluationStatus::ok) return;
  const TrajectoryEvaluation& e = *evaluation;
  const SegmentErrors &far = e.segments[0], &near = e.segments[1];
  const std::string segments =
      far.count > 0    ? fmt::format("; segments of 100 to 800 m {:.3f} %", 100 * far.translation)
      : near.count > 0 ? fmt::format("; segments of 10 to 50 m {:.3f} %", 100 * near.translation)
                       : "";
  progress->print(
      "error against {} over {:.2f} m: ATE {:.4f} m (SE(3)), {:.4f} m (Sim(3), scale {:.4f}){}",
      reference, e.path_reference, e.ate_se3.rmse, e.ate_sim3.rmse, e.sim3.scale, segments);
}

std::vector<std::array<double, 6>> calibration_errors(const RigCalibration& estimate,
                                                      const RigCalibration& truth) {
  std::vector<std::array<double, 6>> errors;
  for (std::size_t k = 1; k < static_cast<std::size_t>(std::min(estimate.cameras, truth.cameras));
       ++k) {
    const Transform &a = estimate.T_camera_left[k], &b = truth.T_camera_left[k];
    const Vec3 turn = log_so3(a.R * b.R.transpose()), shift = a.t - b.t;
    errors.push_back({turn.x(), turn.y(), turn.z(), shift.x(), shift.y(), shift.z()});
  }
  return errors;
}

Json summary_json(const SessionTotals& totals, const SummaryInput& input) {
  Json json;
  json["frames"] = {{"read", totals.read}, {"posed", totals.ok + totals.degraded},
                    {"ok", totals.ok},     {"degraded", totals.degraded},
                    {"lost", totals.lost}, {"skipped", input.skipped}};
  json["input"] = {{"assumptions", input.assumptions}};
  json["path_m"] = totals.path_m;
  json["timing_ms"] = timing_json(totals);
  json["metrics"] = metrics_json(input.evaluation);
  json["calibration"] = calibration_json(totals, input);
  json["recalibrations"] = recalibrations_json(totals);
  json["runtime_allocations"] = input.runtime_allocations;
  Json memory = Json::object();
  std::size_t sum = 0;
  for (const auto& [what, bytes] : input.memory) {
    memory[what] = bytes;
    sum += bytes;
  }
  memory["total_bytes"] = sum;
  memory["allocations_by_thread"] = counters_json(input.allocations.own);
  memory["allocations_by_library_thread"] = counters_json(input.allocations.libraries);
  json["memory"] = memory;
  const BudgetStatistics& work = totals.work_dropped;
  json["work_dropped"] = {{"budget_ms", ms(input.frame_budget.to_seconds() * 1e3)},
                          {"frames", work.frames},
                          {"points", work.points},
                          {"keyframes", work.keyframes},
                          {"steps", work.steps},
                          {"windows", work.windows}};
  json["drops"] = {
      {"frames", input.skipped},           {"estimator", input.dropped_by_estimator},
      {"records", totals.dropped_records}, {"readings", totals.dropped_readings},
      {"lines", totals.lost_lines},        {"recorder_high_water", totals.ring_high_water}};
  json["devices"] = counters_json(input.devices);
  json["comparison"] = counters_json(input.comparison);
  json["enu"] = input.enu;
  json["time"] = input.time;
  json["truth"] = truth_json(input.truth, input);
  json["schema_version"] = kSchemaVersion;
  json["version"] = std::string(version());
  json["simd"] = features::simd_target();
  json["configuration_hash"] = input.configuration_hash;
  return json;
}

}  // namespace vergence::app
