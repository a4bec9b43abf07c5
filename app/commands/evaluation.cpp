#include "app/commands/evaluation.hpp"

#include <algorithm>
#include <iostream>
#include <limits>
#include <system_error>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "app/commands/evaluation_report.hpp"
#include "app/runtime/terminal_text.hpp"
#include "app/session/ins_comparison.hpp"
#include "app/session/ins_file.hpp"
#include "core/math/angle.hpp"
#include "core/math/robust.hpp"

namespace vergence::app {
namespace {

namespace fs = std::filesystem;

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
  // True if the file contains INS samples, false if it contains poses.
  bool is_ins = false;
};

Reference load_reference(const EvaluationRequest& a) {
  if (a.reference.empty() && !a.estimate_ins_extrinsics)
    throw InputError(
        "REFERENCE is missing; pass a trajectory file, or with --estimate-ins-extrinsics a session "
        "directory with ins.csv");
  // A session folder stands for its poses, but where a mount is asked for: that is the INS's.
  const std::filesystem::path path = a.reference.empty() ? a.estimate : a.reference;
  std::error_code ignored;
  const bool poses = !a.estimate_ins_extrinsics && std::filesystem::is_directory(path, ignored);
  const std::filesystem::path ins = poses ? std::filesystem::path{} : find_ins_file(path);
  if (!ins.empty()) return {ins, true};
  if (a.reference.empty())
    throw InputError(a.estimate.string() +
                     ": is not a session directory with ins.csv; pass a REFERENCE");
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
  const std::string help = "put the sequence's times.txt next to it";
  if (from.is_ins) throw InputError(a.estimate.string() + ": has no times; " + help);
  if (e.rows != r.rows)
    throw InputError(
        fmt::format("{}: has {} poses and {} has {}: {}, so poses are matched row by row and both "
                    "files need the same number of rows; {}",
                    a.estimate.string(), e.rows, from.path.string(), r.rows,
                    e.timed   ? "the reference has no times"
                    : r.timed ? "the estimate has no times"
                              : "neither has times",
                    help));
  warn(
      std::string(e.timed == r.timed ? "neither file has times" : "one of the files has no times") +
      ": poses are matched row by row");
  if (e.timed == r.timed) return;
  TrajectoryFile& without = e.timed ? r : e;
  const TrajectoryFile& with = e.timed ? e : r;
  if (without.poses.size() != with.poses.size())
    throw InputError("one file has no times, and rows with NaN are skipped in one of the files; " +
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

/// A reference at the estimate's body, and how it came there.
struct Brought {
  Trajectory poses{};
  // Set if the extrinsics are to be estimated; `poses` is empty unless the status is ok.
  FoundMount found{};
  // Set if INS samples are used with extrinsics that are not estimated here.
  std::optional<InsMount> estimated{};
};

Brought bring_ins(const EvaluationRequest& a, const std::filesystem::path& readings,
                  const Trajectory& estimate) {
  const std::vector<MountReference> moments = ins_moments(read_ins_file(readings));
  if (moments.empty())
    throw InputError(
        readings.string() +
        ": has no sample with an attitude and a satellite fix; record the INS with both");
  Brought out;
  out.poses = poses_of(moments);
  // With axes other than the camera's both bodies are forward, left, up.
  if (a.estimate_ins_extrinsics)
    out.found = find_ins_mount(estimate, moments);
  else if (a.options.axes == BodyAxes::camera)
    out.estimated = load_ins_mount(a.estimate, readings);
  return out;
}

Brought bring_reference(const EvaluationRequest& a, const Reference& from, Files* files) {
  const Trajectory& estimate = files->estimate.poses;
  Brought out;
  if (from.is_ins) {
    out = bring_ins(a, from.path, estimate);
  } else {
    out.poses = files->reference.poses;
    if (a.estimate_ins_extrinsics) out.found = find_mount(estimate, out.poses);
  }
  if (a.estimate_ins_extrinsics && out.found.status == MountStatus::ok)
    out.poses = brought_over(out.poses, out.found.mount.T_ref_est);
  if (out.estimated) out.poses = brought_over(out.poses, out.estimated->T_ins_left);
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
  std::cerr << "vergence: no INS extrinsics between " << a.estimate.string() << " and "
            << from.path.string() << ": " << mount_problem(found.status) << '\n';
  return ExitCode::not_usable;
}

/// Returns the advice where positions agree and rotations do not; empty if both agree.
std::string rotation_remark(const Files& files, const TrajectoryEvaluation& e) {
  constexpr double kRotationsDiffer = 20 * kRadiansPerDegree;
  // Relative to the path length.
  constexpr double kPositionsAgree = 0.05;
  if (e.se3.roll_unobservable || e.ate_se3.rmse >= kPositionsAgree * e.path_reference ||
      e.rotation_se3.median <= kRotationsDiffer)
    return "";
  const auto other = [](const TrajectoryFile& file) {
    return file.order == QuaternionOrder::xyzw ? "wxyz" : "xyzw";
  };
  return fmt::format(
      "positions agree, but rotations differ by {:.0f}° (median); check the order of the "
      "quaternions (--quaternion {}, for the reference --quaternion ,{}), that rotations are from "
      "body to world, and the axes of both bodies (--estimate-ins-extrinsics estimates a constant "
      "rotation)",
      e.rotation_se3.median * kDegreesPerRadian, other(files.estimate), other(files.reference));
}

void print(const EvaluationRequest& a, const EvaluationOptions& options, const Brought& reference,
           const TrajectoryEvaluation& evaluation) {
  if (a.json) {
    nlohmann::ordered_json out = evaluation_json(evaluation, options);
    if (a.estimate_ins_extrinsics) out["mount"] = mount_json(reference.found);
    if (reference.estimated)
      out["ins_mount"] =
          ins_mount_json(reference.estimated->T_ins_left, reference.estimated->source);
    std::cout << out.dump(1) << '\n';
    return;
  }
  if (a.estimate_ins_extrinsics) std::cout << mount_text(reference.found);
  if (reference.estimated) std::cout << ins_mount_text(*reference.estimated) << '\n';
  std::cout << evaluation_text(evaluation, options);
}

}  // namespace

ExitCode run_evaluation(const EvaluationRequest& a) {
  EvaluationOptions options = a.options;
  const Reference from = load_reference(a);
  Files files = read_files(a, from);
  const Trajectory& estimate = files.estimate.poses;
  const Brought reference = bring_reference(a, from, &files);
  if (a.estimate_ins_extrinsics && reference.found.status != MountStatus::ok)
    return report_no_mount(a, from, reference.found);
  TrajectoryEvaluation evaluation = evaluate(estimate, reference.poses, options);
  if (a.usual_lengths) keep_longest(&evaluation, &options);
  print(a, options, reference, evaluation);
  const Duration interval = usual_interval(reference.poses);
  if (evaluation.status == EvaluationStatus::ok) {
    if (const std::string holes = gap_remark(evaluation, options, interval); !holes.empty())
      warn(holes);
    if (const std::string remark = rotation_remark(files, evaluation); !remark.empty())
      warn(remark);
    return ExitCode::done;
  }
  warn(a.estimate.string() + " against " + from.path.string() + ": " +
       evaluation_problem(evaluation, options, interval));
  if (counts_frames(estimate) != counts_frames(reference.poses))
    warn((counts_frames(estimate) ? a.estimate : from.path).string() +
         ": its first column has frame numbers instead of times; write the times of the frames "
         "there");
  return ExitCode::not_usable;
}

}  // namespace vergence::app
