#pragma once
#include <CLI/App.hpp>

#include "app/runtime/errors.hpp"

namespace vergence::app {

/// The word `calibrate` as the checkerboard tool understands it: boards, and files of other
/// programs; as add_…() of app/commands/commands.hpp.
void add_board_calibration(CLI::App& root, ExitCode* exit_code);

}  // namespace vergence::app
