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
  CLI::App* command = root.add_subcommand(
      "run", "Run live on the cameras, trigger and INS of a configuration, real or simulated");
  add_option(*command, "CONFIG", a->configuration,
             "Configuration file (docs/configuration.md), e.g. app/config/mock.yaml", "FILE")
      ->required();
  add_option(*command, "--out", a->out, "Session directory; must not exist, or be empty", "DIR",
             "Output")
      ->required();
  command
      ->add_flag("--fast", a->fast, "Simulated rig only: run faster than real time, drop nothing")
      ->group("Simulation");
  add_option(*command, "--fault", a->faults,
             "Simulated rig only: inject a fault, e.g. \"knock@42 pitch_deg=0.2\"; repeatable",
             "\"KIND@SECONDS …\"", "Simulation")
      ->allow_extra_args(false);
  add_option(*command, "--duration", a->duration_s, "Stop after this many seconds", "SECONDS",
             "Input");
  command
      ->add_flag("--from-scratch", a->from_scratch, "Ignore known extrinsics; estimate them online")
      ->group("Calibration");
  add_option(*command, "--calibration", a->calibration,
             "Initial calibration (vergence, Kalibr, ROS, OpenCV)", "FILE", "Calibration");
  add_option(*command, "--record", a->record,
             "Record poses, ins, images or pulses to drive.mcap (docs/session_files.md)", "TOPICS",
             "Output");
  command->footer(
      "Example: vergence run app/config/mock.yaml --fast --out sessions/mock\n"
      "SIGUSR1 requests a recalibration.\n" +
      std::string(kSessionExitCodes));
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
