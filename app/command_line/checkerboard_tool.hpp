#pragma once
#include <filesystem>
#include <optional>

#include "app/command_line/program.hpp"
#include "app/runtime/errors.hpp"

namespace vergence::app {

/// The executable that does what needs OpenCV: beside the program (a build folder), or in
/// ../libexec/vergence (an installation).
inline constexpr const char* kCheckerboardTool = "vergence-checkerboard";

/// Where it is, of a program that lies in `folder`. Nothing: it is not installed.
[[nodiscard]] std::optional<std::filesystem::path> find_checkerboard_tool(
    const std::filesystem::path& folder);

/// Becomes that executable, with the same words: it has this process's terminal, signals and exit
/// code, and this does not return.
/// InputError: it is not there, or cannot be started.
[[nodiscard]] ExitCode run_checkerboard_tool(const ProgramWords& words);

}  // namespace vergence::app
