#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/command_line/common_options.hpp"
#include "app/commands/commands.hpp"
#include "app/publish/publish.hpp"
#include "app/session/live_source.hpp"

namespace vergence::app {
namespace {

/// The words as given; checked when the command runs.
struct RunArguments {
  CommonOptions common;
  std::string configuration, out;
  std::vector<std::string> faults;
  std::optional<std::string> calibration, record;
  std::optional<double> duration_s;
  bool fast = false, from_scratch = false, memory = false, page = false;
};

RunRequest run_request(const RunArguments& a) {
  if (a.duration_s && !(*a.duration_s > 0 && *a.duration_s <= 86400))
    throw InputError("--duration needs seconds, more than 0 and at most 86400");
  RunRequest r;
  r.session.out = a.out;
  r.configuration = a.common.configuration(
      a.configuration, a.record ? std::vector<std::string>{"record=[" + *a.record + "]"}
                                : std::vector<std::string>{});
  r.calibration.from_scratch = a.from_scratch;
  if (a.calibration) r.calibration.file = *a.calibration;
  r.faults = a.faults;
  r.duration_s = a.duration_s;
  r.fast = a.fast;
  r.session.quiet = a.common.quiet;
  r.session.print_memory = a.memory;
  return r;
}

}  // namespace

void add_run(CLI::App& root, ExitCode* exit_code) {
  const auto a = std::make_shared<RunArguments>();
  CLI::App* command = root.add_subcommand("run",
                                          "Drive: with the cameras, the trigger board and the INS "
                                          "of a configuration, real or rendered");
  command
      ->add_option("CONFIG", a->configuration,
                   "Configuration (docs/configuration.md), e.g. app/config/mock.yaml")
      ->required();
  command->add_option("--out", a->out, "Session folder; must not exist or be empty")
      ->required()
      ->type_name("DIR");
  command->add_flag("--fast", a->fast,
                    "Mock: virtual time, as fast as this machine allows; nothing is dropped");
  command
      ->add_option("--fault", a->faults,
                   "Mock: something that goes wrong, as in \"knock@42 camera=1 pitch_deg=0.2\"; as "
                   "often as needed")
      ->type_name("\"KIND@SECONDS …\"")
      ->allow_extra_args(false);
  command->add_option("--duration", a->duration_s, "End the drive after so many seconds")
      ->type_name("S");
  command->add_flag("--from-scratch", a->from_scratch,
                    "Find the calibration from the drive itself: only intrinsics and the "
                    "baseline's length are read");
  command
      ->add_option("--calibration", a->calibration,
                   "calibration.yaml, or a file of Kalibr, ROS or OpenCV, to begin with, instead "
                   "of the state file's and the "
                   "configuration's; SIGUSR1 asks for a new one during the drive")
      ->type_name("FILE");
  command
      ->add_option(
          "--record", a->record,
          "What is recorded into drive.mcap, e.g. poses,ins,images,pulses (docs/session_files.md)")
      ->type_name("WORDS");
  declare_session_options(*command, &a->memory, &a->page);
  a->common.declare(*command);
  command->callback([a, exit_code] {
    RunRequest request = run_request(*a);
    if (a->page) page_by_default(&request.configuration);
    Publishing publishing(request.configuration);
    publishing.attach(&request.session);
    *exit_code = run_drive(request);
  });
}

}  // namespace vergence::app
