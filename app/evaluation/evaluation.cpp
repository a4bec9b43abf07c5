#include "app/evaluation/evaluation.hpp"

#include <iostream>
#include <system_error>
#include <vector>

#include <nlohmann/json.hpp>

#include "app/datasets/trajectory_files.hpp"
#include "app/evaluation/evaluation_report.hpp"
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

/// The reference's poses, brought to the estimate's body if that is asked for; *mount then tells
/// how.
Trajectory read_reference(const EvaluationRequest& a, const Reference& from,
                          const Trajectory& estimate, FoundMount* mount) {
  Trajectory reference;
  if (from.is_ins) {
    const std::vector<MountReference> moments = ins_moments(read_ins_file(from.path));
    if (moments.empty())
      throw InputError(from.path.string() +
                       ": has no reading with an attitude and a satellites' fix");
    reference = poses_of(moments);
    if (a.estimate_mount) *mount = find_ins_mount(estimate, moments);
  } else {
    reference = read_trajectory(from.path);
    if (a.estimate_mount) *mount = find_mount(estimate, reference);
  }
  if (a.estimate_mount && mount->status == MountStatus::ok)
    reference = brought_over(reference, mount->mount);
  return reference;
}

}  // namespace

ExitCode run_evaluation(const EvaluationRequest& a) {
  EvaluationOptions options = a.options;
  const Reference from = reference_of(a);
  const Trajectory estimate = read_trajectory(a.estimate);
  FoundMount mount;
  const Trajectory reference = read_reference(a, from, estimate, &mount);
  TrajectoryEvaluation evaluation = evaluate(estimate, reference, options);
  if (a.usual_lengths) keep_longest(&evaluation, &options);
  if (a.json) {
    nlohmann::ordered_json out = evaluation_json(evaluation, options);
    if (a.estimate_mount) out["mount"] = mount_json(mount);
    std::cout << out.dump(1) << '\n';
  } else {
    std::cout << (a.estimate_mount ? mount_text(mount) : "")
              << evaluation_text(evaluation, options);
  }
  if (a.estimate_mount && mount.status != MountStatus::ok) {
    std::cerr << "vergence: no mount between " << a.estimate.string() << " and "
              << from.path.string() << ": " << mount_json(mount)["status"].get<std::string>()
              << '\n';
    return ExitCode::not_usable;
  }
  if (evaluation.status == EvaluationStatus::ok) return ExitCode::done;
  std::cerr << "vergence: " << a.estimate.string() << " against " << from.path.string() << ": "
            << evaluation_problem(evaluation, options) << '\n';
  return ExitCode::not_usable;
}

}  // namespace vergence::app
