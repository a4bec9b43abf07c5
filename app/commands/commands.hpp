#pragma once
#include <CLI/App.hpp>

#include "app/runtime/errors.hpp"

/// Every word of the command line: each function declares its options on `root` and, when its word was given,
/// runs the command from the subcommand's callback and sets *exit_code. InputError may leave the callback.
namespace vergence::app {

void add_evaluate(CLI::App& root, ExitCode* exit_code);
void add_replay(CLI::App& root, ExitCode* exit_code);

}  // namespace vergence::app
