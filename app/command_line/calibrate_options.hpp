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
[[nodiscard]] ExitCode run_checkerboard_tool(const ProgramWords& words);

/// Input of `vergence calibrate`.
enum class CalibrateWay : std::uint8_t { board_images, board_live, drive, convert };

/// The command line of `vergence calibrate`, the words as given: the program declares it, and the
/// checkerboard tool, which the program starts with the same words.
struct CalibrateOptions {
  CommonOptions common{};
  std::string configuration{}, board{}, aprilgrid{}, charuco{}, out{}, model = "radtan", format{},
                                                                       size{}, drive{};
  std::optional<std::string> calibration{};
  std::vector<std::string> left{}, right{}, convert{};
  std::vector<std::string> more_cameras{};  // one pattern each
  std::optional<std::string> keep_views{};
  std::optional<double> square{}, marker{}, baseline{};
  std::string dictionary = "5X5_1000";
  double spacing = 0.3;  // Kalibr's own sheets
  std::string to{};
  std::string left_topic{}, right_topic{};  // --drive
  bool sixth_order = false, json = false, force = false;

  /// The subcommand with its options; `this` outlives its parsing.
  CLI::App* declare(CLI::App& root);
  /// InputError: none of the ways, or several.
  [[nodiscard]] CalibrateWay way() const;
};

/// Before the board is carried around for half an hour, not after it: InputError unless a file can
/// be written there. One that is there already is overwritten with `force` only.
void check_writable(const std::filesystem::path& file, bool force);

}  // namespace vergence::app
