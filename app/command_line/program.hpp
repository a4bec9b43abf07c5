#pragma once
#include <span>

#include <CLI/App.hpp>

#include "app/runtime/errors.hpp"

namespace vergence::app {

/// Arguments of main() including the program's name; valid as long as the process.
using ProgramArguments = std::span<const char* const>;

/// Declares the commands of a program on `root`, as the add_…() of app/commands/commands.hpp do.
using AddCommands = void (*)(CLI::App& root, const ProgramArguments& arguments,
                             ExitCode* exit_code);

/// Runs a program: parses, runs one command, and turns every exception into one message on stderr
/// and an exit code.
[[nodiscard]] ExitCode run_program(int argc, const char* const* argv,
                                   AddCommands add_commands) noexcept;

}  // namespace vergence::app
