#include "app/evaluation/evaluation.hpp"

#include <iostream>
#include <optional>
#include <system_error>
#include <vector>

#include <nlohmann/json.hpp>

#include "app/datasets/trajectory_files.hpp"
#include "app/evaluation/evaluation_report.hpp"
#include "app/evaluation/ins_mount.hpp"
#include "app/evaluation/mount_report.hpp"
#include "app/recorder/ins_file.hpp"

namespace vergence::app {
namespace {

/// Of the usual lengths those that the path is long enough for; KITTI's where it is for none.
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

Reference reference_of(const EvaluationRequest& a) {
  if (a.reference.empty() && !a.estimate_mount)
    throw InputError(
        "REFERENCE is missing; name a trajectory, or with --estimate-mount a session folder that "
        "has an ins.csv");
  // A session folder stands for its poses, but where a mount is asked for: that is the INS's.
  const std::filesystem::path path = a.reference.empty() ? a.estimate : a.reference;
  std::error_code ignored;
  const bool poses = !a.estimate_mount && std::filesystem::is_directory(path, ignored);
  const std::filesystem::path ins = poses ? std::filesystem::path{} : find_ins_file(path);
  if (!ins.empty()) return {ins, true};
  if (a.reference.empty())
    throw InputError(a.estimate.string() +
                     ": is no session folder with an ins.csv; name a REFERENCE");
  return {path, false};
}

/// A reference at the estimate's body, and how it came there.
struct Brought {
  Trajectory poses{};
  FoundMount found{};              // where a mount is asked for; not ok: there are no poses
  std::optional<InsMount> told{};  // of an INS's readings, else
};

Brought bring_ins(const EvaluationRequest& a, const std::filesystem::path& readings,
                  const Trajectory& estimate) {
  const std::vector<MountReference> moments = ins_moments(read_ins_file(readings));
  if (moments.empty())
    throw InputError(readings.string() + ": has no reading with an attitude and a satellites' fix");
  Brought out;
  out.poses = poses_of(moments);
  if (a.estimate_mount)
    out.found = find_ins_mount(estimate, moments);
  else if (a.options.axes == BodyAxes::camera)  // else both are forward, left, up
    out.told = ins_mount_of(a.estimate, readings);
  return out;
}

Brought bring_reference(const EvaluationRequest& a, const Reference& from,
                        const Trajectory& estimate) {
  Brought out;
  if (from.is_ins) {
    out = bring_ins(a, from.path, estimate);
  } else {
    out.poses = read_trajectory(from.path);
    if (a.estimate_mount) out.found = find_mount(estimate, out.poses);
  }
  if (a.estimate_mount && out.found.status == MountStatus::ok)
    out.poses = brought_over(out.poses, out.found.mount.T_ref_est);
  if (out.told) out.poses = brought_over(out.poses, out.told->T_ins_left);
  return out;
}

/// Without a mount nothing can be compared.
ExitCode tell_no_mount(const EvaluationRequest& a, const Reference& from, const FoundMount& found) {
  if (a.json) {
    nlohmann::ordered_json out;
    out["mount"] = mount_json(found);
    std::cout << out.dump(1) << '\n';
  }
  std::cerr << "vergence: no mount between " << a.estimate.string() << " and " << from.path.string()
            << ": " << mount_problem(found.status) << '\n';
  return ExitCode::not_usable;
}

void print(const EvaluationRequest& a, const EvaluationOptions& options, const Brought& reference,
           const TrajectoryEvaluation& evaluation) {
  if (a.json) {
    nlohmann::ordered_json out = evaluation_json(evaluation, options);
    if (a.estimate_mount) out["mount"] = mount_json(reference.found);
    if (reference.told) out["ins_mount"] = ins_mount_json(*reference.told);
    std::cout << out.dump(1) << '\n';
    return;
  }
  if (a.estimate_mount) std::cout << mount_text(reference.found);
  if (reference.told) std::cout << ins_mount_text(*reference.told) << '\n';
  std::cout << evaluation_text(evaluation, options);
}

}  // namespace

ExitCode run_evaluation(const EvaluationRequest& a) {
  EvaluationOptions options = a.options;
  const Reference from = reference_of(a);
  const Trajectory estimate = read_trajectory(a.estimate);
  const Brought reference = bring_reference(a, from, estimate);
  if (a.estimate_mount && reference.found.status != MountStatus::ok)
    return tell_no_mount(a, from, reference.found);
  TrajectoryEvaluation evaluation = evaluate(estimate, reference.poses, options);
  if (a.usual_lengths) keep_longest(&evaluation, &options);
  print(a, options, reference, evaluation);
  if (evaluation.status == EvaluationStatus::ok) return ExitCode::done;
  std::cerr << "vergence: " << a.estimate.string() << " against " << from.path.string() << ": "
            << evaluation_problem(evaluation, options) << '\n';
  return ExitCode::not_usable;
}

}  // namespace vergence::app
