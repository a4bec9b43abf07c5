#include "app/command_line/common_options.hpp"
#include "app/commands/commands.hpp"
#include "app/publish/publish.hpp"
#include "app/session/live_source.hpp"

namespace vergence::app {
namespace {

struct RunArguments {
  CommonOptions common;
  std::string configuration;
  std::optional<std::string> record;
  bool page = false;
  RunRequest request;
};

/// The rest of the request, checked when the command runs.
RunRequest& complete(RunArguments* a) {
  RunRequest& r = a->request;
  r.configuration = a->common.configuration(
      a->configuration, a->record ? std::vector<std::string>{"record=[" + *a->record + "]"}
                                  : std::vector<std::string>{});
  r.session.quiet = a->common.quiet;
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
  add_option(*command, "--out", a->request.session.out,
             "Session directory; must not exist, or be empty", "DIR", "Output")
      ->required();
  add_flag(*command, "--fast", a->request.fast,
           "Simulated rig only: run faster than real time, drop nothing", "Simulation");
  add_option(*command, "--fault", a->request.faults,
             "Simulated rig only: inject a fault, e.g. \"knock@42 pitch_deg=0.2\"; repeatable",
             "\"KIND@SECONDS …\"", "Simulation")
      ->allow_extra_args(false);
  add_option(*command, "--duration", a->request.duration_s, "Stop after this many seconds",
             "SECONDS", "Input")
      ->check(in_range(1e-3, 86400, "seconds"));
  add_flag(*command, "--from-scratch", a->request.calibration.from_scratch,
           "Ignore known extrinsics; estimate them online", "Calibration");
  add_option(*command, "--calibration", a->request.calibration.file,
             "Initial calibration (vergence, Kalibr, ROS, OpenCV)", "FILE", "Calibration");
  add_option(*command, "--record", a->record,
             "Record poses, ins, images or pulses to drive.mcap (docs/session_files.md)", "TOPICS",
             "Output");
  command->footer(
      "Example: vergence run app/config/mock.yaml --fast --out sessions/mock\n"
      "SIGUSR1 requests a recalibration.\n" +
      std::string(kSessionExitCodes));
  declare_session_options(*command, &a->request.session.print_memory, &a->page);
  a->common.declare(*command);
  command->callback([a, exit_code] {
    RunRequest& request = complete(a.get());
    const Publishing publishing(a->page, &request.configuration, &request.session);
    *exit_code = run_drive(request);
  });
}

}  // namespace vergence::app
