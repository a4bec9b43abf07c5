#include "app/command_line/common_options.hpp"
#include "app/commands/commands.hpp"
#include "app/devices/snap_session.hpp"

namespace vergence::app {
namespace {

struct SnapArguments {
  std::vector<std::string> set;
  std::string configuration;
  SnapRequest request;
};

/// The rest of the request, checked when the command runs.
const SnapRequest& complete(SnapArguments* a) {
  a->request.configuration = load_configuration(a->configuration, a->set);
  return a->request;
}

}  // namespace

void add_snap(CLI::App& root, ExitCode* exit_code) {
  const auto a = std::make_shared<SnapArguments>();
  CLI::App* command =
      root.add_subcommand("snap", "Capture synchronised test images and check them");
  add_option(*command, "CONFIG", a->configuration,
             "Configuration file; only its cameras and trigger are used", "FILE")
      ->required();
  add_option(*command, "--out", a->request.out,
             "Directory for images and snap.json; must not exist, or be empty", "DIR")
      ->required();
  add_option(*command, "--count", a->request.count, "Number of image sets [1]", "N")
      ->check(in_range(1, 9999, "image sets"));
  add_option(*command, "--wait", a->request.wait_s, "Maximum wait for each image set [5]",
             "SECONDS")
      ->check(in_range(1e-3, 3600, "seconds"));
  add_option(*command, "--set", a->set, "Set a configuration key; repeatable", "KEY=VALUE")
      ->allow_extra_args(false);
  command->footer(
      "Example: vergence snap app/config/gige.yaml --out first\n"
      "Exit codes: 0 success; 1 an image is unusable (black, overexposed, identical); 2 bad "
      "arguments;\n3 a camera is missing or sent nothing.");
  command->callback([a, exit_code] { *exit_code = capture_images(complete(a.get())); });
}

}  // namespace vergence::app
