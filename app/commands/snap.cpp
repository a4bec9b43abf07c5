#include <memory>
#include <string>

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
  SnapRequest& r = a->request;
  if (r.count < 1 || r.count > 9999) throw InputError("--count must be 1 to 9999 image sets");
  if (!(r.wait_s > 0 && r.wait_s <= 3600))
    throw InputError("--wait must be above 0 and at most 3600 seconds");
  r.configuration = load_configuration(a->configuration, a->set);
  return r;
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
  add_option(*command, "--count", a->request.count, "Number of image sets [1]", "N");
  add_option(*command, "--wait", a->request.wait_s, "Maximum wait for each image set [5]",
             "SECONDS");
  add_option(*command, "--set", a->set, "Set a configuration key; repeatable", "KEY=VALUE")
      ->allow_extra_args(false);
  command->footer(
      "Example: vergence snap app/config/gige.yaml --out first\n"
      "Exit codes: 0 success; 1 an image is unusable (black, overexposed, identical); "
      "2 bad arguments;\n3 a camera is missing or sent nothing.");
  command->callback([a, exit_code] { *exit_code = capture_images(complete(a.get())); });
}

}  // namespace vergence::app
