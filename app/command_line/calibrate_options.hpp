#pragma once
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <CLI/App.hpp>

#include "app/command_line/common_options.hpp"
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
[[nodiscard]] ExitCode run_checkerboard_tool(const ProgramArguments& arguments);

/// The subcommands of `vergence calibrate`.
enum class CalibrateCommand : std::uint8_t { target, live, sequence, convert };

/// The command lines of `vergence calibrate`, the words as given: the program declares them, and
/// the checkerboard tool, which the program starts with the same words.
struct CalibrateOptions {
  /// The subcommand of the words; the callback of the command that declare() returns may read it.
  CalibrateCommand given = CalibrateCommand::target;
  CommonOptions common{};
  std::string configuration{}, data{}, in{}, out{};
  std::string board{}, aprilgrid{}, charuco{}, model = "radtan", format = "auto", size{}, to{};
  std::optional<std::string> calibration{};
  std::vector<std::string> left{}, right{};
  std::vector<std::string> more_cameras{};  // one pattern each
  std::optional<std::string> keep_views{};
  std::optional<double> square{}, marker{}, baseline{};
  std::string dictionary = "5X5_1000";
  double spacing = 0.3;  // Kalibr's own sheets
  std::string left_topic{}, right_topic{};
  bool sixth_order = false, json = false, force = false;

  /// Declares the command and its subcommands, each with its own options; `this` outlives their
  /// parsing.
  CLI::App* declare(CLI::App& root);
};

/// Before the board is carried around for half an hour, not after it: InputError unless a file can
/// be written there. One that is there already is overwritten with `force` only.
void check_writable(const std::filesystem::path& file, bool force);

}  // namespace vergence::app
