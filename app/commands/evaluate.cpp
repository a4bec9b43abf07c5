#include "app/command_line/common_options.hpp"
#include "app/commands/commands.hpp"
#include "app/commands/evaluation.hpp"
#include "app/datasets/text_file.hpp"

namespace vergence::app {
namespace {

// Maximum duration in s: eleven days, longer than any recording.
constexpr double kLongest = 1e6;

/// The words as given; checked when the command runs.
struct EvaluateArguments {
  EvaluationRequest request;
  // Segment lengths in m.
  std::optional<std::string> lengths;
  std::optional<int> step;
  std::string associate = "interpolate";
  // Limits in s.
  double max_gap = 0.2;
  double max_difference = 0.005;
  std::string axes = "camera";
  // Each is ESTIMATE[,REFERENCE].
  std::string unit, quaternion;
};

std::vector<double> parse_lengths(const std::string& text) {
  constexpr std::size_t kMax = 1000;
  std::vector<std::string_view> fields(kMax);
  const std::size_t count = split(text, ',', fields);
  if (count > kMax)
    throw InputError("--lengths has more than " + std::to_string(kMax) + " lengths");
  std::vector<double> lengths(count);
  for (std::size_t i = 0; i < count; ++i)
    if (!parse_number(fields[i], &lengths[i]) || !(lengths[i] > 0))
      throw InputError("--lengths: `" + std::string(fields[i]) +
                       "` is not a length in metres; give them like 100,200,300");
  return lengths;
}

/// KITTI's lengths, and shorter ones for drives that are too short for these.
std::vector<SegmentOptions> usual_segments(const std::optional<int>& step) {
  return {{{100, 200, 300, 400, 500, 600, 700, 800}, step.value_or(10), false},
          {{10, 20, 30, 40, 50}, step.value_or(1), false},
          {{1, 2, 3, 4, 5}, step.value_or(1), false},
          {{0.1, 0.2, 0.3, 0.4, 0.5}, step.value_or(1), false}};
}

/// `ms`, `ms,s`, `,s`: of the estimate's file and of the reference's.
template <class Value, class Parse>
std::array<std::optional<Value>, 2> parse_pair(const char* option, const std::string& text,
                                               const char* words, const Parse& parse) {
  std::array<std::optional<Value>, 2> pair;
  std::array<std::string_view, 2> fields;
  const std::size_t count = split(text, ',', fields);
  for (std::size_t i = 0; i < std::min(count, fields.size()); ++i)
    if (!fields[i].empty()) pair[i] = parse(fields[i]);
  const bool read = (fields[0].empty() || pair[0]) && (fields[1].empty() || pair[1]);
  if (count > fields.size() || !read)
    throw InputError(std::string(option) + " is \"" + text.substr(0, 40) + "\"; it takes " + words +
                     " for ESTIMATE, and after a comma the same for REFERENCE, as in s,ns");
  return pair;
}

std::optional<QuaternionOrder> parse_order(std::string_view word) {
  if (word == "xyzw") return QuaternionOrder::xyzw;
  if (word == "wxyz") return QuaternionOrder::wxyz;
  return std::nullopt;
}

EvaluationOptions make_options(const EvaluateArguments& a) {
  EvaluationOptions options{
      .association = a.associate == "nearest" ? Association::nearest : Association::interpolate,
      .max_gap = Duration::seconds(a.max_gap),
      .max_difference = Duration::seconds(a.max_difference),
      .axes = a.axes == "flu" ? BodyAxes::forward_left_up : BodyAxes::camera};
  if (a.lengths)
    options.segments = {{parse_lengths(*a.lengths), a.step.value_or(10), false}};
  else
    for (const SegmentOptions& usual : usual_segments(a.step)) options.segments.push_back(usual);
  return options;
}

/// The rest of the request, checked when the command runs.
const EvaluationRequest& complete(EvaluateArguments* a) {
  EvaluationRequest& r = a->request;
  r.options = make_options(*a);
  r.usual_lengths = !a->lengths;
  r.units = parse_pair<TimeUnit>("--time-unit", a->unit, "s, ms, us or ns", parse_time_unit);
  r.quaternions =
      parse_pair<QuaternionOrder>("--quaternion", a->quaternion, "xyzw or wxyz", parse_order);
  return r;
}

}  // namespace

void add_evaluate(CLI::App& root, ExitCode* exit_code) {
  const auto a = std::make_shared<EvaluateArguments>();
  CLI::App* command = root.add_subcommand(
      "evaluate", "Compare a trajectory with ground truth (ATE, segment errors)");
  add_option(*command, "ESTIMATE", a->request.estimate,
             "Trajectory file, session or data-set directory", "DIR|FILE")
      ->required();
  add_option(*command, "REFERENCE", a->request.reference,
             "Trajectory file, KITTI or EuRoC directory, or ins.csv", "DIR|FILE");
  command->add_flag("--json", a->request.json, "Print JSON");
  add_option(*command, "--lengths", a->lengths,
             "Segment lengths in metres [100 to 800; shorter ones for short paths]", "M,...");
  add_option(*command, "--step", a->step,
             "Start a segment at every Nth pose [10; 1 for short segments]", "N")
      ->check(in_range(1, 1e9, "poses"));
  command
      ->add_option("--associate", a->associate,
                   "Reference at an estimate's stamp: interpolated, or the nearest pose")
      ->check(one_of({"interpolate", "nearest"}))
      ->capture_default_str();
  add_option(*command, "--max-gap", a->max_gap,
             "With interpolate: longest gap of the reference that is bridged", "SECONDS")
      ->check(in_range(0, kLongest, "seconds"))
      ->capture_default_str();
  add_option(*command, "--max-difference", a->max_difference,
             "With nearest: largest difference of the stamps", "SECONDS")
      ->check(in_range(0, kLongest, "seconds"))
      ->capture_default_str();
  command
      ->add_option("--axes", a->axes,
                   "Axes of both bodies: camera (z forward), or flu (x forward, y left, z up)")
      ->check(one_of({"camera", "flu"}))
      ->capture_default_str();
  add_option(*command, "--time-unit", a->unit,
             "Time unit of ESTIMATE[,REFERENCE]: s, ms, us or ns [detected]", "UNIT");
  add_option(*command, "--quaternion", a->quaternion,
             "Quaternion order of ESTIMATE[,REFERENCE]: xyzw or wxyz [detected, else xyzw]",
             "ORDER");
  command->add_flag("--estimate-ins-extrinsics", a->request.estimate_ins_extrinsics,
                    "Estimate lever arm and boresight of the INS");
  command->footer(
      "Example: vergence evaluate sessions/monday truth.tum --json\n"
      "Exit codes: 0 success; 1 no result; 2 bad arguments or input.");
  command->callback([a, exit_code] { *exit_code = run_evaluation(complete(a.get())); });
}

}  // namespace vergence::app
