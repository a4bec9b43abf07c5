#pragma once
#include "app/command_line/program.hpp"

/// Commands of the program. Each function declares its options on `root`. If its command was given,
/// the subcommand's callback runs it and sets *exit_code; the callback may throw InputError.
namespace vergence::app {

/// `arguments` is the command line for the checkerboard tool.
void add_calibrate(CLI::App& root, const ProgramArguments& arguments, ExitCode* exit_code);
void add_devices(CLI::App& root, ExitCode* exit_code);
void add_doctor(CLI::App& root, ExitCode* exit_code);
void add_evaluate(CLI::App& root, ExitCode* exit_code);
void add_export(CLI::App& root, ExitCode* exit_code);
void add_replay(CLI::App& root, ExitCode* exit_code);
void add_report(CLI::App& root, ExitCode* exit_code);
void add_run(CLI::App& root, ExitCode* exit_code);
void add_simulate(CLI::App& root, ExitCode* exit_code);
void add_snap(CLI::App& root, ExitCode* exit_code);

/// Adds all commands of `vergence`.
void add_all_commands(CLI::App& root, const ProgramArguments& arguments, ExitCode* exit_code);

}  // namespace vergence::app
