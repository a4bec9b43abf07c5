#pragma once
#include <span>

#include <CLI/App.hpp>

#include "app/runtime/errors.hpp"

namespace vergence::app {

/// A command line as main() has it, the program's own name first; lives as long as the process.
using ProgramArguments = std::span<const char* const>;

/// Declares the commands of a program on `root`, as add_…() of app/commands/commands.hpp do.
using AddCommands = void (*)(CLI::App& root, const ProgramArguments& arguments,
                             ExitCode* exit_code);

/// A whole program: parses, runs one command, turns every exception into one message on stderr and
/// an exit code.
[[nodiscard]] ExitCode run_program(int argc, const char* const* argv,
                                   AddCommands add_commands) noexcept;

}  // namespace vergence::app
