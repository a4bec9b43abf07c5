#pragma once
#include "app/command_line/common_options.hpp"
#include "app/command_line/program.hpp"

namespace vergence::app {

/// Executable for everything that needs OpenCV, next to the program (build directory) or in
/// ../libexec/vergence (installation).
inline constexpr const char* kCheckerboardTool = "vergence-checkerboard";

/// Path of that executable for a program in `folder`; empty if it is not installed.
[[nodiscard]] std::optional<std::filesystem::path> find_checkerboard_tool(
    const std::filesystem::path& folder);

/// Executes that program with the same arguments in place of this process; does not return on
/// success. Throws InputError if it is missing or cannot be started.
[[nodiscard]] ExitCode run_checkerboard_tool(const ProgramArguments& arguments);

/// Subcommands of `vergence calibrate`.
enum class CalibrateCommand : std::uint8_t { target, live, sequence, convert };

/// Command line of `vergence calibrate`, declared by the program and by the checkerboard tool,
/// which the program starts with the same arguments.
struct CalibrateOptions {
  /// Selected subcommand, valid in the callback of the command that declare() returns.
  CalibrateCommand given = CalibrateCommand::target;
  CommonOptions common{};
  std::string configuration{}, data{}, in{}, out{};
  std::string board{}, aprilgrid{}, charuco{}, model = "radtan", format = "auto", size{}, to{};
  std::optional<std::string> calibration{};
  std::vector<std::string> left{}, right{};
  /// One file pattern per camera.
  std::vector<std::string> more_cameras{};
  std::optional<std::string> keep_views{};
  std::optional<double> square{}, marker{}, baseline{};
  std::string dictionary = "5X5_1000";
  /// Default of Kalibr's sheets.
  double spacing = 0.3;
  std::string left_topic{}, right_topic{};
  bool sixth_order = false, json = false, force = false;

  /// Declares the command and its subcommands with their options. This object must outlive the
  /// parsing.
  CLI::App* declare(CLI::App& root);
};

/// Throws InputError unless a file can be written there, so that a problem is reported before
/// images are taken. An existing file is overwritten only with `force`.
void check_writable(const std::filesystem::path& file, bool force);

}  // namespace vergence::app
