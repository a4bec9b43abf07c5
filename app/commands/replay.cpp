#include "app/command_line/common_options.hpp"
#include "app/commands/commands.hpp"
#include "app/publish/publish.hpp"
#include "app/session/replay_session.hpp"

namespace vergence::app {
namespace {

// Largest value of --start and --frames.
constexpr double kMostFrames = 1e9;

/// The words as given; checked when the command runs.
struct ReplayArguments {
  CommonOptions common;
  std::string format = "auto", model = "radtan";
  std::optional<double> focal;
  bool page = false;
  ReplayRequest request;
};

std::optional<AssumedIntrinsics> known_numbers(const ReplayArguments& a) {
  if (!a.focal) return std::nullopt;
  if (a.request.calibration)
    throw InputError(
        "--focal and --calibration exclude each other; use --focal only without a calibration");
  if (!a.request.baseline)
    throw InputError(
        "--focal needs --baseline, the distance of the two cameras in metres; images cannot show "
        "it");
  return AssumedIntrinsics{*a.focal, *a.request.baseline,
                           a.model == "equidistant" ? CameraModelKind::pinhole_equidistant
                                                    : CameraModelKind::pinhole_radtan};
}

/// The rest of the request, checked when the command runs.
ReplayRequest& complete(ReplayArguments* a) {
  ReplayRequest& r = a->request;
  r.format = sequence_format(a->format, r.data);
  check_topics(r.format, r.topics);
  r.known = known_numbers(*a);
  if (r.calibrate_first && r.from_scratch)
    throw InputError("--calibrate-first already starts from scratch; remove --from-scratch");
  r.calibrate_first = r.calibrate_first || (r.known && !r.from_scratch);
  r.configuration = a->common.configuration(std::nullopt, r.format == SequenceFormat::session
                                                              ? recorded_settings(r.data)
                                                              : std::vector<std::string>{});
  r.session.quiet = a->common.quiet;
  return r;
}

}  // namespace

void add_replay(CLI::App& root, ExitCode* exit_code) {
  const auto a = std::make_shared<ReplayArguments>();
  CLI::App* command =
      root.add_subcommand("replay", "Run odometry on a recorded data set and write a session");
  add_option(*command, "DATA", a->request.data, "Data-set directory, or a .mcap, .db3 or .bag file",
             "DIR|FILE")
      ->required();
  add_option(
      *command, "--format", a->format,
      "Format of DATA: auto, folder, kitti, kitti-raw, euroc, st-lucia, mcap, db3, rosbag, session",
      "NAME", "Input")
      ->capture_default_str();
  add_option(*command, "--out", a->request.session.out,
             "Session directory; must not exist, or be empty", "DIR", "Output")
      ->required();
  declare_image_topics(*command, &a->request.topics.left, &a->request.topics.right);
  add_option(*command, "--ins-topic", a->request.topics.ins,
             "Bag topic of the INS (NavSatFix), if ambiguous", "TOPIC", "Input");
  add_option(*command, "--imu-topic", a->request.topics.imu,
             "Bag topic of sensor_msgs/Imu giving the INS attitude", "TOPIC", "Input");
  add_option(*command, "--start", a->request.start, "Index of the first frame", "N", "Input")
      ->check(in_range(0, kMostFrames, "frames"));
  add_option(*command, "--frames", a->request.frames, "Maximum number of frames", "N", "Input")
      ->check(in_range(1, kMostFrames, "frames"));
  add_option(*command, "--calibration", a->request.calibration,
             "Initial calibration (vergence, Kalibr, ROS, OpenCV …)", "FILE", "Calibration");
  add_option(*command, "--baseline", a->request.baseline,
             "Baseline length in metres; overrides the calibration", "M", "Calibration")
      ->check(in_range(0.005, 20, "metres"));
  add_option(*command, "--focal", a->focal,
             "Initial focal length of both cameras in pixels, with --baseline", "PX", "Calibration")
      ->check(in_range(10, 1e5, "pixels"));
  add_option(*command, "--model", a->model,
             "Lens model for --focal: radtan, or equidistant (fisheye)", "NAME", "Calibration")
      ->check(one_of({"radtan", "equidistant"}))
      ->capture_default_str();
  add_flag(*command, "--from-scratch", a->request.from_scratch,
           "Ignore known extrinsics; estimate them online", "Calibration");
  add_flag(*command, "--calibrate-first", a->request.calibrate_first,
           "Calibrate from the whole sequence, then run (3 passes)", "Calibration");
  command->footer(
      "Example: vergence replay FOLDER --focal 458 --baseline 0.11 --out sessions/first\n" +
      std::string(kSessionExitCodes));
  declare_session_options(*command, &a->request.session.print_memory, &a->page);
  a->common.declare(*command);
  command->callback([a, exit_code] {
    ReplayRequest& request = complete(a.get());
    const Publishing publishing(a->page, &request.configuration, &request.session);
    *exit_code = run_replay(request);
  });
}

}  // namespace vergence::app
