#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "app/command_line/common_options.hpp"
#include "app/commands/commands.hpp"
#include "app/datasets/sequence_format.hpp"
#include "app/publish/publish.hpp"
#include "app/session/replay_session.hpp"

#include <fmt/format.h>

namespace vergence::app {
namespace {

/// The words as given; checked when the command runs.
struct ReplayArguments {
  CommonOptions common;
  std::string format = "auto", model = "radtan";
  std::optional<double> focal;
  std::int64_t start = 0;
  std::optional<std::int64_t> frames;
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
  if (!(*a.focal >= 10 && *a.focal <= 1e5))
    throw InputError(
        fmt::format("replay: --focal {:g}: must be 10 to 100000, in pixels", *a.focal));
  return AssumedIntrinsics{*a.focal, *a.request.baseline,
                           a.model == "equidistant" ? CameraModelKind::pinhole_equidistant
                                                    : CameraModelKind::pinhole_radtan};
}

/// The rest of the request, checked when the command runs.
ReplayRequest& complete(ReplayArguments* a) {
  ReplayRequest& r = a->request;
  if (r.baseline && !(*r.baseline >= 0.005 && *r.baseline <= 20))
    throw InputError(fmt::format(
        "replay: --baseline {:g}: must be 0.005 to 20, the distance of the cameras in metres",
        *r.baseline));
  if (a->start < 0)
    throw InputError(fmt::format("replay: --start {}: must be 0 or more", a->start));
  if (a->frames && *a->frames < 1)
    throw InputError(fmt::format("replay: --frames {}: must be at least 1", *a->frames));
  r.start = static_cast<std::size_t>(a->start);
  if (a->frames) r.frames = static_cast<std::size_t>(*a->frames);
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
  add_option(*command, "--format", a->format,
             "Format of DATA: auto, folder, kitti, kitti-raw, euroc, st-lucia, mcap, db3, "
             "rosbag, session",
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
  add_option(*command, "--start", a->start, "Index of the first frame", "N", "Input");
  add_option(*command, "--frames", a->frames, "Maximum number of frames", "N", "Input");
  add_option(*command, "--calibration", a->request.calibration,
             "Initial calibration (vergence, Kalibr, ROS, OpenCV …)", "FILE", "Calibration");
  add_option(*command, "--baseline", a->request.baseline,
             "Baseline length in metres; overrides the calibration", "M", "Calibration");
  add_option(*command, "--focal", a->focal,
             "Initial focal length of both cameras in pixels, with --baseline", "PX",
             "Calibration");
  add_option(*command, "--model", a->model,
             "Lens model for --focal: radtan, or equidistant (fisheye)", "NAME", "Calibration")
      ->check(one_of({"radtan", "equidistant"}))
      ->capture_default_str();
  command
      ->add_flag("--from-scratch", a->request.from_scratch,
                 "Ignore known extrinsics; estimate them online")
      ->group("Calibration");
  command
      ->add_flag("--calibrate-first", a->request.calibrate_first,
                 "Calibrate from the whole sequence, then run (3 passes)")
      ->group("Calibration");
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
