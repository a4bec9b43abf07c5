#pragma once
#include <CLI/App.hpp>

#include "app/command_line/program.hpp"
#include "app/runtime/errors.hpp"

/// Every word of the command line: each function declares its options on `root` and, when its word
/// was given, runs the command from the subcommand's callback and sets *exit_code. InputError may
/// leave the callback.
namespace vergence::app {

/// `arguments`: command line of the checkerboard tool.
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

/// All of them: what `vergence` is made of.
void add_all_commands(CLI::App& root, const ProgramArguments& arguments, ExitCode* exit_code);

}  // namespace vergence::app
