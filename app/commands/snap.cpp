#include <memory>
#include <string>

#include "app/capture/snap_session.hpp"
#include "app/command_line/common_options.hpp"
#include "app/commands/commands.hpp"

namespace vergence::app {
namespace {

struct SnapArguments {
  std::vector<std::string> set;
  std::string configuration, out;
  int count = 1;
  double wait_s = 5;
};

SnapRequest snap_request(const SnapArguments& a) {
  if (a.count < 1 || a.count > 9999)
    throw InputError("--count needs a number of sets from 1 to 9999");
  if (!(a.wait_s > 0 && a.wait_s <= 3600))
    throw InputError("--wait needs seconds, more than 0 and at most 3600");
  SnapRequest r;
  r.configuration = load_configuration(a.configuration, a.set);
  r.out = a.out;
  r.count = a.count;
  r.wait_s = a.wait_s;
  return r;
}

}  // namespace

void add_snap(CLI::App& root, ExitCode* exit_code) {
  const auto a = std::make_shared<SnapArguments>();
  CLI::App* command = root.add_subcommand("snap",
                                          "Take one picture with every camera of a configuration, "
                                          "at the same time, and say what is wrong with them");
  command
      ->add_option("CONFIG", a->configuration,
                   "Configuration (docs/configuration.md); of the devices only its cameras and "
                   "trigger are used")
      ->required();
  command
      ->add_option("--out", a->out,
                   "Folder for the pictures and snap.json; must not exist or be empty")
      ->required()
      ->type_name("DIR");
  command->add_option("--count", a->count, "Take so many sets, one after the other")
      ->type_name("N");
  command->add_option("--wait", a->wait_s, "Longest wait for a set")->type_name("S");
  command->add_option("--set", a->set, "Set a key of the configuration; as often as needed")
      ->type_name("KEY=VALUE")
      ->allow_extra_args(false);
  command->footer(
      "Exit code: 0 done, 1 the pictures are no good (black, white, twice the same), 2 "
      "bad arguments,\n"
      "3 a camera is not there or sent nothing.");
  command->callback([a, exit_code] { *exit_code = capture_images(snap_request(*a)); });
}

}  // namespace vergence::app
