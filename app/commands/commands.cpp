#include "app/commands/commands.hpp"

namespace vergence::app {

void add_all_commands(CLI::App& root, const ProgramArguments& arguments, ExitCode* exit_code) {
  add_run(root, exit_code);
  add_replay(root, exit_code);
  add_evaluate(root, exit_code);
  add_report(root, exit_code);
  add_export(root, exit_code);
  add_simulate(root, exit_code);
  add_devices(root, exit_code);
  add_doctor(root, exit_code);
  add_snap(root, exit_code);
  add_calibrate(root, arguments, exit_code);
}

}  // namespace vergence::app
