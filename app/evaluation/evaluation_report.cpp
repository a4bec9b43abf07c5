#include "app/evaluation/evaluation_report.hpp"

#include <cassert>
#include <cmath>
#include <iterator>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "core/math/angle.hpp"

namespace vergence::app {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kPercent = 100.0;

Json statistics_json(const ErrorStatistics& s, double unit) {
  return {{"rmse", s.rmse * unit},
          {"mean", s.mean * unit},
          {"median", s.median * unit},
          {"max", s.max * unit}};
}

Json heading_json(const HeadingErrors& h) {
  return {{"rms", h.rms * kDegreesPerRadian},
          {"mean", h.mean * kDegreesPerRadian},
          {"max_abs", h.max_abs * kDegreesPerRadian},
          {"last", h.last * kDegreesPerRadian}};
}

Json vector_json(const Vec3& v) { return Json::array({v.x(), v.y(), v.z()}); }

/// A length as people write it: 100, not 100.0.
Json length_json(double length) {
  constexpr double kExactIntegers = 1e15;
  if (length == std::floor(length) && length < kExactIntegers)
    return static_cast<std::int64_t>(length);
  return length;
}

Json segments_json(const SegmentErrors& segments) {
  Json lengths = Json::array(), rows = Json::object();
  for (const LengthError& row : segments.per_length) {
    lengths.push_back(length_json(row.length));
    rows[fmt::format("{}", row.length)] = {{"n", row.count},
                                           {"t_percent", row.translation * kPercent},
                                           {"r_deg_per_m", row.rotation * kDegreesPerRadian}};
  }
  return {{"step", segments.step},
          {"lengths", lengths},
          {"per_length", rows},
          {"n", segments.count},
          {"t_percent", segments.translation * kPercent},
          {"r_deg_per_m", segments.rotation * kDegreesPerRadian}};
}

std::string left_out(const TrajectoryEvaluation& e, const EvaluationOptions& options) {
  const char* inside = options.association == Association::nearest
                           ? "without a neighbour near enough"
                           : "in holes of the reference";
  return fmt::format("{} before the reference, {} after it, {} {}", e.before, e.after, e.gap,
                     inside);
}

void statistics_row(std::string* out, const char* name, const ErrorStatistics& s, double unit,
                    const char* symbol) {
  fmt::format_to(std::back_inserter(*out), "  {:<34}{:>11.4f} {:>11.4f} {:>11.4f} {:>11.4f}  {}\n",
                 name, s.rmse * unit, s.mean * unit, s.median * unit, s.max * unit, symbol);
}

void heading_row(std::string* out, const char* name, const HeadingErrors& h) {
  fmt::format_to(std::back_inserter(*out), "  {:<34}{:>11.4f} {:>11.4f} {:>11.4f} {:>11.4f}  deg\n",
                 name, h.rms * kDegreesPerRadian, h.mean * kDegreesPerRadian,
                 h.max_abs * kDegreesPerRadian, h.last * kDegreesPerRadian);
}

void segment_rows(std::string* out, const SegmentErrors& segments) {
  auto at = std::back_inserter(*out);
  fmt::format_to(at, "\n  segments, from every {}. pose        number   translation    rotation\n",
                 segments.step);
  const auto row = [&](const std::string& name, std::size_t count, double translation,
                       double rotation) {
    if (count == 0)
      fmt::format_to(at, "  {:<34}{:>8}   the path is too short\n", name, "none");
    else
      fmt::format_to(at, "  {:<34}{:>8} {:>10.4f} %  {:>10.6f} deg/m\n", name, count,
                     translation * kPercent, rotation * kDegreesPerRadian);
  };
  for (const LengthError& length : segments.per_length)
    row(fmt::format("{} m", length.length), length.count, length.translation, length.rotation);
  row("all", segments.count, segments.translation, segments.rotation);
}

}  // namespace

nlohmann::ordered_json evaluation_json(const TrajectoryEvaluation& e,
                                       const EvaluationOptions& options) {
  Json out;
  out["matched"] = e.matched;
  out["dropped"] = Json::object();
  // Of nearest neighbours only the match is defined, not on which side the others lie.
  if (options.association == Association::interpolate)
    out["dropped"] = {{"before", e.before}, {"after", e.after}, {"gap", e.gap}};
  if (e.status != EvaluationStatus::ok) return out;

  out["path_reference_m"] = e.path_reference;
  out["path_estimate_m"] = e.path_estimate;
  out["path_ratio_estimate_over_reference"] = e.path_ratio;
  out["ate_se3_m"] = statistics_json(e.ate_se3, 1.0);
  out["se3_rotation_vector_rad"] = vector_json(log_so3(e.se3.R_reference_estimate));
  out["se3_translation_m"] = vector_json(e.se3.t_reference_estimate);
  out["sim3_scale"] = e.sim3.scale;
  out["ate_sim3_m"] = statistics_json(e.ate_sim3, 1.0);
  out["ate_unaligned_m"] = statistics_json(e.ate_unaligned, 1.0);
  out["heading_error_deg"] = heading_json(e.heading_se3);
  out["heading_error_start_aligned_deg"] = heading_json(e.heading_start_aligned);
  out["rotation_error_deg"] = statistics_json(e.rotation_se3, kDegreesPerRadian);
  out["roll_about_path_unobservable"] = e.se3.roll_unobservable;
  out["end_error_aligned_m"] = e.end_error_se3;
  out["end_error_start_aligned_m"] = e.end_error_start_aligned;
  out["end_error_start_aligned_percent"] = e.end_error_ratio * kPercent;
  out["end_rotation_start_aligned_deg"] = e.end_rotation_start_aligned * kDegreesPerRadian;
  out["segments"] = Json::array();
  for (const SegmentErrors& segments : e.segments)
    out["segments"].push_back(segments_json(segments));
  return out;
}

std::string evaluation_text(const TrajectoryEvaluation& e, const EvaluationOptions& options) {
  std::string out;
  auto at = std::back_inserter(out);
  fmt::format_to(at, "{} poses matched; left out: {}\n", e.matched, left_out(e, options));
  if (e.status != EvaluationStatus::ok) return out;
  fmt::format_to(at, "path: reference {:.3f} m, estimate {:.3f} m, ratio {:.6f}\n",
                 e.path_reference, e.path_estimate, e.path_ratio);
  fmt::format_to(
      at, "scale: {:.6f} (Sim(3): reference = scale * R * estimate + t; reported, not applied)\n\n",
      e.sim3.scale);

  fmt::format_to(at, "  {:<34}{:>11} {:>11} {:>11} {:>11}\n", "position error", "rmse", "mean",
                 "median", "max");
  statistics_row(&out, "SE(3)-aligned", e.ate_se3, 1.0, "m");
  statistics_row(&out, "Sim(3)-aligned", e.ate_sim3, 1.0, "m");
  statistics_row(&out, "not aligned", e.ate_unaligned, 1.0, "m");
  fmt::format_to(at, "\n  {:<34}{:>11} {:>11} {:>11} {:>11}\n", "heading error", "rms", "mean",
                 "max", "last");
  heading_row(&out, "start-aligned", e.heading_start_aligned);
  heading_row(&out, "SE(3)-aligned", e.heading_se3);
  fmt::format_to(at, "\n  {:<34}{:>11} {:>11} {:>11} {:>11}\n", "rotation error", "rmse", "mean",
                 "median", "max");
  statistics_row(&out, "SE(3)-aligned", e.rotation_se3, kDegreesPerRadian, "deg");
  if (e.se3.roll_unobservable)
    out +=
        "  The path is nearly straight: positions do not hold the rotation about it. Use the "
        "start-aligned angles.\n";

  fmt::format_to(at, "\n  {:<34}{:>11.4f} m = {:.4f} % of the path, {:.4f} deg\n",
                 "end error, start-aligned", e.end_error_start_aligned,
                 e.end_error_ratio * kPercent, e.end_rotation_start_aligned * kDegreesPerRadian);
  fmt::format_to(at, "  {:<34}{:>11.4f} m\n", "end error, SE(3)-aligned", e.end_error_se3);
  for (const SegmentErrors& segments : e.segments) segment_rows(&out, segments);
  return out;
}

std::string gap_remark(const TrajectoryEvaluation& e, const EvaluationOptions& options,
                       Duration interval) {
  if (e.gap <= e.matched || options.association == Association::nearest) return "";
  constexpr double kRoom = 1.1;  // above the interval, whose length varies
  constexpr double kSteps = 20;  // of the number that is proposed, in a second
  const double seconds = interval.to_seconds();
  return fmt::format(
      "{} poses lie in holes of the reference, whose poses are {:.3g} s apart (median), wider than "
      "--max-gap {:g}; --max-gap {:g} bridges them",
      e.gap, seconds, options.max_gap.to_seconds(), std::ceil(kSteps * kRoom * seconds) / kSteps);
}

std::string evaluation_problem(const TrajectoryEvaluation& e, const EvaluationOptions& options,
                               Duration interval) {
  const std::string holes = gap_remark(e, options, interval);
  switch (e.status) {
    case EvaluationStatus::no_match:
      if (!holes.empty()) return holes;
      return fmt::format(
          "no pose of the estimate has a reference at its time ({}): are both stamped by the same "
          "clock?",
          left_out(e, options));
    case EvaluationStatus::too_few:
      return fmt::format("only {} poses matched, an alignment needs three ({}){}{}", e.matched,
                         left_out(e, options), holes.empty() ? "" : "; ", holes);
    case EvaluationStatus::no_motion:
      return "one of the two trajectories stays in one place, there is nothing to align";
    case EvaluationStatus::ok:
      break;
  }
  assert(false);
  return {};
}

}  // namespace vergence::app
