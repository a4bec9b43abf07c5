#include "app/commands/evaluation.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <iostream>
#include <iterator>
#include <limits>
#include <span>
#include <system_error>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "app/runtime/terminal_text.hpp"
#include "app/session/ins_file.hpp"
#include "core/comparison/comparison.hpp"
#include "core/comparison/geodesy.hpp"
#include "core/comparison/mount.hpp"
#include "core/math/angle.hpp"
#include "core/math/robust.hpp"
#include "core/math/so3.hpp"

namespace vergence::app {
namespace {

namespace fs = std::filesystem;
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

/// The figures of an evaluation for a machine. Keys carry their unit; a figure that does not exist
/// is null. With a status other than ok: the counts alone.
Json evaluation_json(const TrajectoryEvaluation& e, const EvaluationOptions& options) {
  Json out;
  out["matched"] = e.matched;
  out["dropped"] = Json::object();
  // For nearest neighbours only the match is defined, not on which side the others lie.
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

/// That most poses lie in holes of the reference, and what bridges them; empty: they do not.
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

/// Why there are no metrics. `interval`: the usual one between the reference's poses. Precondition:
/// the status is not ok.
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

/// Transform between the bodies of two trajectories. Not ok: only the status is valid.
struct FoundMount {
  MountStatus status = MountStatus::too_few;
  Mount mount{};
  bool of_ins = false;  // the reference is an INS and the estimate a camera
};

Json value_json(const MountValue& v, double unit) {
  return {{"value", v.observable ? Json(v.value * unit) : Json(nullptr)},
          {"sigma", v.sigma * unit}};
}

std::string row(const char* what, const MountValue& v, double unit, const char* name) {
  if (!v.observable)
    return fmt::format("  {:<34}not_observable (sigma {:.3g} {})\n", what, v.sigma * unit, name);
  return fmt::format("  {:<34}{:>11.4f} ± {:.4f} {}\n", what, v.value * unit, v.sigma * unit, name);
}

/// Value for `ins.boresight_deg`: roll, pitch, yaw. Nullopt: the reference is no INS, or a
/// component is not observable.
std::optional<Vec3> boresight_deg(const FoundMount& found) {
  const auto& r = found.mount.rotation;
  if (!found.of_ins ||
      !std::all_of(r.begin(), r.end(), [](const MountValue& v) { return v.observable; }))
    return std::nullopt;
  return boresight_of(found.mount.T_ref_est.R) * kDegreesPerRadian;
}

const char* mount_problem(MountStatus status) {
  switch (status) {
    case MountStatus::too_few:
      return "fewer than 20 moments in common; give a longer drive, or check that both have the "
             "same clock";
    case MountStatus::no_motion:
      return "nothing moved: a mount shows only while driving";
    case MountStatus::not_converged:
      return "no fit: the two trajectories are not of the same drive, their clocks are more than "
             "0.3 s apart, or their attitudes drift apart by more than 15 degrees";
    case MountStatus::ok:
      break;
  }
  return "";
}

/// A value that is not observable is null, with its sigma.
Json mount_json(const FoundMount& found) {
  Json out;
  out["status"] = found.status == MountStatus::ok ? "ok" : mount_problem(found.status);
  if (found.status != MountStatus::ok) return out;
  const Mount& m = found.mount;
  constexpr std::array<const char*, 3> kAxes{"x", "y", "z"};
  for (std::size_t k = 0; k < 3; ++k) {
    out["rotation_deg"][kAxes[k]] = value_json(m.rotation[k], kDegreesPerRadian);
    out["lever_arm_m"][kAxes[k]] = value_json(m.lever_arm[k], 1);
  }
  out["clock_offset_s"] = value_json(m.clock_offset, 1);
  if (const auto boresight = boresight_deg(found)) out["boresight_deg"] = vector_json(*boresight);
  out["moments"] = m.moments;
  out["residual_rotation_deg"] = m.residual_rotation * kDegreesPerRadian;
  out["residual_position_m"] = m.residual_position;
  return out;
}

std::string mount_text(const FoundMount& found) {
  const Mount& m = found.mount;
  std::string out = fmt::format(
      "mount of the {}, from {} moments (residuals {:.3f} deg, {:.3f} m)\n",
      found.of_ins ? "left camera in the INS's body" : "estimate's body in the reference's",
      m.moments, m.residual_rotation * kDegreesPerRadian, m.residual_position);
  out += row("turn about the reference's x", m.rotation[0], kDegreesPerRadian, "deg");
  out += row("turn about its y", m.rotation[1], kDegreesPerRadian, "deg");
  out += row("turn about its z", m.rotation[2], kDegreesPerRadian, "deg");
  out += row("lever arm along x", m.lever_arm[0], 1, "m");
  out += row("lever arm along y", m.lever_arm[1], 1, "m");
  out += row("lever arm along z", m.lever_arm[2], 1, "m");
  out += row("reference's stamps are late by", m.clock_offset, 1e3, "ms (reported, not applied)");
  if (const auto b = boresight_deg(found))
    out +=
        fmt::format("  as the configuration has it: ins.boresight_deg: [{:.2f}, {:.2f}, {:.2f}]\n",
                    b->x(), b->y(), b->z());
  return out + "\n";
}

/// The samples with an attitude and a satellite fix, in the ENU axes of the first one's position.
std::vector<MountReference> ins_moments(std::span<const InsRecord> readings) {
  const auto placed = [](const InsRecord& r) {
    return r.sample.attitude_valid &&
           (r.sample.fix == FixStatus::fix_2d || r.sample.fix == FixStatus::fix_3d);
  };
  std::vector<MountReference> moments;
  const auto first = std::find_if(readings.begin(), readings.end(), placed);
  if (first == readings.end()) return moments;
  const LocalTangentPlane plane(first->sample.position);
  moments.reserve(readings.size());
  for (const InsRecord& r : readings) {
    if (!placed(r)) continue;
    const InsSample& s = r.sample;
    const auto& [x, y, z, w] = s.q_enu_ins;
    const Mat3 R_enu_local = plane.rotation_from(s.position);
    const Transform T_enu_ins{
        R_enu_local * Eigen::Quaterniond(w, x, y, z).normalized().toRotationMatrix(),
        plane.to_enu(s.position)};
    const auto& [east, north, up] = s.velocity_enu;
    moments.push_back({s.stamp, T_enu_ins, R_enu_local * Vec3(east, north, up), s.velocity_valid});
  }
  return moments;
}

/// The fit with the smallest rotation from one of these nominal rotations.
FoundMount find_mount(const Trajectory& estimate, std::span<const MountReference> reference,
                      std::span<const Mat3> nominals) {
  FoundMount best;
  double least = std::numeric_limits<double>::max();
  for (const Mat3& nominal : nominals) {
    FoundMount found;
    found.status = estimate_ins_extrinsics(estimate, reference, nominal, {}, &found.mount);
    const auto& r = found.mount.rotation;
    const double turn = Vec3(r[0].value, r[1].value, r[2].value).norm();
    if (found.status == MountStatus::ok && turn < least) {
      least = turn;
      best = found;
    } else if (best.status != MountStatus::ok) {
      best.status = found.status;
    }
  }
  return best;
}

/// Returns the usual lengths that fit the path; KITTI's if none fits.
void keep_longest(TrajectoryEvaluation* e, EvaluationOptions* options) {
  if (e->segments.size() < 2) return;
  std::size_t kept = 0;
  for (std::size_t i = e->segments.size(); i-- > 0;)
    if (e->segments[i].count > 0) kept = i;
  e->segments = {e->segments[kept]};
  options->segments = {options->segments[kept]};
}

/// Where the reference is.
struct Reference {
  std::filesystem::path path{};
  bool is_ins = false;  // readings of an INS; else poses
};

Reference load_reference(const EvaluationRequest& a) {
  if (a.reference.empty() && !a.estimate_ins_extrinsics)
    throw InputError(
        "REFERENCE is missing; name a trajectory, or with --estimate-ins-extrinsics a session "
        "folder that "
        "has an ins.csv");
  // A session folder stands for its poses, but where a mount is asked for: that is the INS's.
  const std::filesystem::path path = a.reference.empty() ? a.estimate : a.reference;
  std::error_code ignored;
  const bool poses = !a.estimate_ins_extrinsics && std::filesystem::is_directory(path, ignored);
  const std::filesystem::path ins = poses ? std::filesystem::path{} : find_ins_file(path);
  if (!ins.empty() && !a.estimate_ins_extrinsics)
    throw InputError(ins.string() +
                     ": has INS samples; add --estimate-ins-extrinsics, or compare with the "
                     "reference.tum of its session");
  if (!ins.empty()) return {ins, true};
  if (a.reference.empty())
    throw InputError(a.estimate.string() +
                     ": is no session folder with an ins.csv; name a REFERENCE");
  return {path, false};
}

/// Both as they are read; an INS's readings are no trajectory yet.
struct Files {
  TrajectoryFile estimate{}, reference{};
};

void warn(const std::string& message) { std::cerr << "vergence: " << harmless(message) << '\n'; }

/// Rows of a file without times belong to the rows of the other one, with its times if it has some.
void pair_rows(const EvaluationRequest& a, const Reference& from, Files* files) {
  TrajectoryFile &e = files->estimate, &r = files->reference;
  if (e.timed && (r.timed || from.is_ins)) return;
  const std::string help = "put the sequence's times.txt beside it";
  if (from.is_ins) throw InputError(a.estimate.string() + ": has no times; " + help);
  if (e.rows != r.rows)
    throw InputError(fmt::format(
        "{}: has {} poses and {} has {}: {}, so that row belongs to row, which takes as many; {}",
        a.estimate.string(), e.rows, from.path.string(), r.rows,
        e.timed   ? "the reference has no times"
        : r.timed ? "the estimate has no times"
                  : "neither has times",
        help));
  warn(
      std::string(e.timed == r.timed ? "neither file has times" : "one of the files has no times") +
      ": row belongs to row");
  if (e.timed == r.timed) return;
  TrajectoryFile& without = e.timed ? r : e;
  const TrajectoryFile& with = e.timed ? e : r;
  if (without.poses.size() != with.poses.size())
    throw InputError("rows without numbers are skipped in one of the files, which has no times; " +
                     help);
  for (std::size_t i = 0; i < with.poses.size(); ++i) without.poses[i].stamp = with.poses[i].stamp;
}

TrajectoryFile read(const fs::path& path, std::optional<TimeUnit> unit,
                    std::optional<QuaternionOrder> quaternion, std::string_view unit_option) {
  TrajectoryFile file = read_trajectory_file(path, {unit, quaternion, unit_option});
  if (!file.remarks.empty())
    warn(fmt::format("{}: {}", path.string(), fmt::join(file.remarks, "; ")));
  return file;
}

/// One unit given is the estimate's, and also the reference's where that has none to be told by.
TrajectoryFile read_reference(const EvaluationRequest& a, const fs::path& path) {
  constexpr std::string_view kOption =
      "--time-unit ,s (or ,ms ,us ,ns: the reference's follows the comma)";
  if (a.units[1] || !a.units[0]) return read(path, a.units[1], a.quaternions[1], kOption);
  try {
    return read(path, std::nullopt, a.quaternions[1], kOption);
  } catch (const InputError&) {
    return read(path, a.units[0], a.quaternions[1], kOption);
  }
}

Files read_files(const EvaluationRequest& a, const Reference& from) {
  Files files;
  files.estimate = read(a.estimate, a.units[0], a.quaternions[0], "--time-unit s, ms, us or ns");
  if (!from.is_ins) files.reference = read_reference(a, from.path);
  pair_rows(a, from, &files);
  return files;
}

Duration usual_interval(const Trajectory& poses) {
  std::vector<std::int64_t> ns;
  for (std::size_t i = 1; i < poses.size(); ++i)
    ns.push_back(poses[i].stamp.ns() / 2 - poses[i - 1].stamp.ns() / 2);
  if (ns.empty()) return {};
  return Duration::nanoseconds(
      2 * std::min(median(std::span(ns)), std::numeric_limits<std::int64_t>::max() / 2));
}

/// Stamps of 0 s, 1 s, 2 s … are most often numbers of frames.
bool counts_frames(const Trajectory& poses) {
  constexpr std::int64_t kSecond = 1'000'000'000;
  for (std::size_t i = 0; i < poses.size(); ++i)
    if (poses[i].stamp.ns() != poses[0].stamp.ns() + static_cast<std::int64_t>(i) * kSecond ||
        poses[0].stamp.ns() % kSecond != 0 || std::abs(poses[0].stamp.ns()) > kSecond)
      return false;
  return poses.size() > 1;
}

/// The reference at the estimate's body. Stamps stay: a clock offset is reported, not applied.
struct Brought {
  Trajectory poses{};
  FoundMount found{};  // with --estimate-ins-extrinsics; not ok: there are no poses
};

Brought bring_reference(const EvaluationRequest& a, const Reference& from, const Files& files) {
  if (!a.estimate_ins_extrinsics) return {files.reference.poses, {}};
  std::vector<MountReference> moments;
  if (from.is_ins) moments = ins_moments(read_ins_file(from.path));
  for (const StampedPose& pose : files.reference.poses)
    moments.push_back({pose.stamp, pose.T_world_body, Vec3::Zero(), false});
  if (moments.empty())
    throw InputError(from.path.string() +
                     ": has no sample with an attitude and a satellite fix; check the INS");
  // A camera looks along the INS's x axis; of two trajectories neither body's axes are known.
  const Mat3 R_flu_camera = mount_of(Vec3::Zero(), Vec3::Zero()).R;
  const std::array<Mat3, 3> nominals{R_flu_camera, Mat3::Identity(), R_flu_camera.transpose()};
  Brought out;
  out.found = find_mount(files.estimate.poses, moments,
                         std::span(nominals).first(from.is_ins ? 1U : nominals.size()));
  out.found.of_ins = from.is_ins;
  for (const MountReference& m : moments)
    out.poses.push_back({m.stamp, m.T_enu_ref * out.found.mount.T_ref_est});
  return out;
}

/// Without a mount nothing can be compared.
ExitCode report_no_mount(const EvaluationRequest& a, const Reference& from,
                         const FoundMount& found) {
  if (a.json) {
    nlohmann::ordered_json out;
    out["mount"] = mount_json(found);
    std::cout << out.dump(1) << '\n';
  }
  std::cerr << "vergence: no mount between " << a.estimate.string() << " and " << from.path.string()
            << ": " << mount_problem(found.status) << '\n';
  return ExitCode::not_usable;
}

/// Returns true if positions agree and rotations do not.
bool rotations_differ(const TrajectoryEvaluation& e) {
  constexpr double kPositionsAgree = 0.05;  // of the path
  constexpr double kRotationsDiffer = 20 * kRadiansPerDegree;
  return e.status == EvaluationStatus::ok && !e.se3.roll_unobservable &&
         e.ate_se3.rmse < kPositionsAgree * e.path_reference &&
         e.rotation_se3.median > kRotationsDiffer;
}

void print(const EvaluationRequest& a, const EvaluationOptions& options, const Brought& reference,
           const TrajectoryEvaluation& evaluation) {
  if (a.json) {
    nlohmann::ordered_json out = evaluation_json(evaluation, options);
    if (a.estimate_ins_extrinsics) out["mount"] = mount_json(reference.found);
    std::cout << out.dump(1) << '\n';
    return;
  }
  if (a.estimate_ins_extrinsics) std::cout << mount_text(reference.found);
  std::cout << evaluation_text(evaluation, options);
}

}  // namespace

ExitCode run_evaluation(const EvaluationRequest& a) {
  EvaluationOptions options = a.options;
  const Reference from = load_reference(a);
  const Files files = read_files(a, from);
  const Trajectory& estimate = files.estimate.poses;
  const Brought reference = bring_reference(a, from, files);
  if (a.estimate_ins_extrinsics && reference.found.status != MountStatus::ok)
    return report_no_mount(a, from, reference.found);
  TrajectoryEvaluation evaluation = evaluate(estimate, reference.poses, options);
  if (a.usual_lengths) keep_longest(&evaluation, &options);
  print(a, options, reference, evaluation);
  const Duration interval = usual_interval(reference.poses);
  if (evaluation.status == EvaluationStatus::ok) {
    if (const std::string holes = gap_remark(evaluation, options, interval); !holes.empty())
      warn(holes);
    if (rotations_differ(evaluation))
      warn(fmt::format(
          "positions agree and rotations do not ({:.0f} deg, median): check the order of the "
          "quaternions (--quaternion wxyz) and the body axes (--estimate-ins-extrinsics finds the "
          "rotation between two bodies)",
          evaluation.rotation_se3.median * kDegreesPerRadian));
    return ExitCode::done;
  }
  warn(a.estimate.string() + " against " + from.path.string() + ": " +
       evaluation_problem(evaluation, options, interval));
  if (counts_frames(estimate) != counts_frames(reference.poses))
    warn((counts_frames(estimate) ? a.estimate : from.path).string() +
         ": its first column counts the poses: these are numbers of frames and no times; put the "
         "times of the frames there");
  return ExitCode::not_usable;
}

}  // namespace vergence::app
