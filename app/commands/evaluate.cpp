#include <cmath>
#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include <nlohmann/json.hpp>

#include "app/commands/commands.hpp"
#include "app/commands/evaluation_report.hpp"
#include "app/commands/mount_report.hpp"
#include "app/datasets/text_file.hpp"
#include "app/datasets/trajectory_files.hpp"
#include "app/recorder/ins_file.hpp"

namespace vergence::app {
namespace {

/// The words as given; checked when the command runs.
struct Arguments {
  std::string estimate, reference;
  bool json = false, estimate_mount = false;
  std::optional<std::string> lengths;  // m
  std::optional<int> step;
  std::string associate = "interpolate";
  double max_gap = 0.2;           // s
  double max_difference = 0.005;  // s
  std::string axes = "camera";
};

std::vector<double> parse_lengths(const std::string& text) {
  constexpr std::size_t kMost = 1000;
  std::vector<std::string_view> fields(kMost);
  const std::size_t count = split(text, ',', fields);
  if (count > kMost)
    throw InputError("--lengths has more than " + std::to_string(kMost) + " lengths");
  std::vector<double> lengths(count);
  for (std::size_t i = 0; i < count; ++i)
    if (!parse_number(fields[i], &lengths[i]) || !(lengths[i] > 0))
      throw InputError("--lengths: `" + std::string(fields[i]) +
                       "` is not a length in metres; give them like 100,200,300");
  return lengths;
}

Duration parse_duration(const char* option, double seconds) {
  constexpr double kLongest = 1e6;  // s: eleven days, longer than a drive
  if (!(seconds >= 0) || seconds > kLongest)
    throw InputError(std::string(option) + " needs seconds between 0 and 1e6");
  return Duration::seconds(seconds);
}

/// KITTI's lengths, and shorter ones for drives that are too short for these.
std::vector<SegmentOptions> usual_segments(const std::optional<int>& step) {
  return {{{100, 200, 300, 400, 500, 600, 700, 800}, step.value_or(10), false},
          {{10, 20, 30, 40, 50}, step.value_or(1), false},
          {{1, 2, 3, 4, 5}, step.value_or(1), false},
          {{0.1, 0.2, 0.3, 0.4, 0.5}, step.value_or(1), false}};
}

EvaluationOptions options_of(const Arguments& a) {
  EvaluationOptions options;
  options.association = a.associate == "nearest" ? Association::nearest : Association::interpolate;
  options.max_gap = parse_duration("--max-gap", a.max_gap);
  options.max_difference = parse_duration("--max-difference", a.max_difference);
  options.axes = a.axes == "flu" ? BodyAxes::forward_left_up : BodyAxes::camera;
  if (a.step && *a.step < 1) throw InputError("--step needs a whole number of poses, 1 or more");
  if (a.lengths)
    options.segments = {{parse_lengths(*a.lengths), a.step.value_or(10), false}};
  else
    for (const SegmentOptions& usual : usual_segments(a.step)) options.segments.push_back(usual);
  return options;
}

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

Reference reference_of(const Arguments& a) {
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
    throw InputError(a.estimate + ": is no session folder with an ins.csv; name a REFERENCE");
  return {path, false};
}

/// The reference's poses, brought to the estimate's body if that is asked for; *mount then tells
/// how.
Trajectory read_reference(const Arguments& a, const Reference& from, const Trajectory& estimate,
                          FoundMount* mount) {
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

ExitCode run(const Arguments& a) {
  EvaluationOptions options = options_of(a);
  const Reference from = reference_of(a);
  const Trajectory estimate = read_trajectory(a.estimate);
  FoundMount mount;
  const Trajectory reference = read_reference(a, from, estimate, &mount);
  TrajectoryEvaluation evaluation = evaluate(estimate, reference, options);
  if (!a.lengths) keep_longest(&evaluation, &options);
  if (a.json) {
    nlohmann::ordered_json out = evaluation_json(evaluation, options);
    if (a.estimate_mount) out["mount"] = mount_json(mount);
    std::cout << out.dump(1) << '\n';
  } else {
    std::cout << (a.estimate_mount ? mount_text(mount) : "")
              << evaluation_text(evaluation, options);
  }
  if (a.estimate_mount && mount.status != MountStatus::ok) {
    std::cerr << "vergence: no mount between " << a.estimate << " and " << from.path.string()
              << ": " << mount_json(mount)["status"].get<std::string>() << '\n';
    return ExitCode::not_usable;
  }
  if (evaluation.status == EvaluationStatus::ok) return ExitCode::done;
  std::cerr << "vergence: " << a.estimate << " against " << from.path.string() << ": "
            << evaluation_problem(evaluation, options) << '\n';
  return ExitCode::not_usable;
}

}  // namespace

void add_evaluate(CLI::App& root, ExitCode* exit_code) {
  const auto a = std::make_shared<Arguments>();
  CLI::App* command = root.add_subcommand("evaluate", "Compare a trajectory with a reference");
  command->add_option("ESTIMATE", a->estimate, "TUM file, session folder, or data set")->required();
  command->add_option(
      "REFERENCE", a->reference,
      "TUM file, KITTI or EuRoC data-set folder, or its truth file; ins.csv of a session");
  command->add_flag("--json", a->json, "The figures as JSON");
  command->add_option(
      "--lengths", a->lengths,
      "Lengths of the segments, m [100,200 … 800, on a shorter drive 10 … 50, 1 … 5 or 0.1 … 0.5]");
  command->add_option("--step", a->step,
                      "A segment begins at every so many poses [10; with shorter lengths 1]");
  command->add_option("--associate", a->associate, "How a reference is found for a pose")
      ->check(CLI::IsMember({"interpolate", "nearest"}))
      ->capture_default_str();
  command
      ->add_option("--max-gap", a->max_gap,
                   "interpolate: widest hole of the reference to bridge, s")
      ->capture_default_str();
  command
      ->add_option("--max-difference", a->max_difference,
                   "nearest: largest difference of stamps, s")
      ->capture_default_str();
  command
      ->add_option("--axes", a->axes,
                   "Axes of the body: camera (z forward) or flu (x forward, y left, z up)")
      ->check(CLI::IsMember({"camera", "flu"}))
      ->capture_default_str();
  command->add_flag("--estimate-mount", a->estimate_mount,
                    "Find how the two bodies sit to one another; compare at the estimate's. "
                    "Without REFERENCE: the session's own INS");
  command->callback([a, exit_code] { *exit_code = run(*a); });
}

}  // namespace vergence::app
