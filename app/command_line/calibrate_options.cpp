#include "app/command_line/calibrate_options.hpp"

#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <iostream>

#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>

namespace vergence::app {

namespace fs = std::filesystem;

std::optional<fs::path> find_checkerboard_tool(const fs::path& folder) {
  for (const fs::path& place :
       {folder / kCheckerboardTool, folder.parent_path() / "libexec/vergence" / kCheckerboardTool})
    if (::access(place.c_str(), X_OK) == 0) return place;
  return std::nullopt;
}

ExitCode run_checkerboard_tool(const ProgramArguments& arguments) {
  const fs::path folder = fs::read_symlink("/proc/self/exe").parent_path();
  const auto tool = find_checkerboard_tool(folder);
  if (!tool)
    throw InputError(
        "calibrate: this needs {0}, which is not installed (it is neither in {1}, next to the "
        "program, nor in {2}); install the package {0}, or build it: scripts/setup",
        kCheckerboardTool, folder.string(), (folder.parent_path() / "libexec/vergence").string());
  std::vector<char*> argv;
  // execv() only reads its arguments.
  for (const char* word : arguments) argv.push_back(const_cast<char*>(word));
  argv.push_back(nullptr);
  std::cout.flush();
  ::execv(tool->c_str(), argv.data());
  throw InputError("{}: cannot be started: {}", tool->string(), std::strerror(errno));
}

namespace {

void declare_out(CLI::App& command, CalibrateOptions& o) {
  add_option(command, "--out", o.out, "Calibration file to write", "FILE", "Output")->required();
  add_flag(command, "--force", o.force, "Overwrite an existing file", "Output");
}

/// The options that `target` and `live` share.
void declare_board(CLI::App& command, CalibrateOptions& o) {
  add_option(command, "--checkerboard", o.board,
             "Inner corners of a checkerboard, columns and rows: 9x6", "NxN", "Target");
  add_option(command, "--aprilgrid", o.aprilgrid, "Tags of an AprilGrid (36h11): 6x6", "NxN",
             "Target")
      ->excludes("--checkerboard");
  add_option(command, "--charuco", o.charuco, "Squares of a ChArUco target: 11x8", "NxN", "Target")
      ->excludes("--checkerboard")
      ->excludes("--aprilgrid");
  add_option(command, "--square", o.square, "Size of a square or tag in metres", "M", "Target")
      ->required();
  add_option(command, "--spacing", o.spacing,
             "--aprilgrid: gap between tags relative to their size", "N", "Target")
      ->capture_default_str();
  add_option(command, "--marker", o.marker, "--charuco: size of a marker in metres", "M", "Target");
  add_option(command, "--dictionary", o.dictionary, "--charuco: OpenCV's name of the dictionary",
             "NAME", "Target")
      ->capture_default_str();
  add_option(command, "--model", o.model, "Lens model: radtan, or equidistant (fisheye)", "NAME",
             "Calibration")
      ->check(one_of({"radtan", "equidistant"}))
      ->capture_default_str();
  add_flag(command, "--k3", o.sixth_order, "radtan: also estimate k3", "Calibration");
  add_option(command, "--baseline", o.baseline, "Measured baseline in metres, for comparison", "M",
             "Calibration")
      ->check(in_range(0.001, 100, "metres"));
  declare_out(command, o);
  add_flag(command, "--json", o.json, "Print JSON instead of tables", "Output");
  o.common.declare_quiet(command);
}

void declare_target(CLI::App& command, CalibrateOptions& o) {
  add_option(command, "--left", o.left,
             "Images of the left camera, quoted; alone: one camera's intrinsics", "GLOB", "Input")
      ->required();
  add_option(command, "--right", o.right, "Images of the right camera, paired by number or name",
             "GLOB", "Input");
  add_option(command, "--camera", o.more_cameras, "Images of a third and a fourth camera", "GLOB",
             "Input")
      ->needs("--right")
      ->allow_extra_args(false);
  declare_board(command, o);
  command.footer(
      "Example: vergence calibrate target --left 'l*.png' --right 'r*.png' --checkerboard 9x6 "
      "--square 0.025 \\\n           --out calibration.yaml\n"
      "Exit codes: 0 success; 1 no usable calibration; 2 bad arguments or input.");
}

void declare_live(CLI::App& command, CalibrateOptions& o) {
  add_option(command, "CONFIG", o.configuration, "Configuration file (docs/configuration.md)",
             "FILE")
      ->required();
  declare_board(command, o);
  add_option(command, "--keep-views", o.keep_views, "Save the images of accepted views", "DIR",
             "Output");
  o.common.declare_set(command);
  command.footer(
      "Example: vergence calibrate live app/config/gige.yaml --checkerboard 9x6 --square 0.025 "
      "\\\n           --out calibration.yaml\n"
      "Exit codes: 0 success; 1 no usable calibration; 2 bad arguments or configuration;\n"
      "3 camera missing; 130, 143 stopped by SIGINT, SIGTERM.");
}

void declare_sequence(CLI::App& command, CalibrateOptions& o) {
  add_option(command, "DATA", o.data, "Data-set directory, or a .mcap, .db3 or .bag file",
             "DIR|FILE")
      ->required();
  add_option(command, "--format", o.format, "Format of DATA; the names are those of replay", "NAME",
             "Input")
      ->capture_default_str();
  declare_image_topics(command, &o.left_topic, &o.right_topic);
  add_option(command, "--calibration", o.calibration,
             "Initial calibration instead of the data set's (vergence, Kalibr, ROS, OpenCV)",
             "FILE", "Calibration");
  add_option(command, "--baseline", o.baseline,
             "Baseline length in metres; overrides the calibration", "M", "Calibration");
  declare_out(command, o);
  o.common.declare(command);
  command.footer(
      "Example: vergence calibrate sequence FOLDER --out calibration.yaml\n"
      "Exit codes: 0 success; 1 no usable calibration; 2 bad arguments or input;\n"
      "130, 143 stopped by SIGINT, SIGTERM.");
}

void declare_convert(CLI::App& command, CalibrateOptions& o) {
  add_option(command, "IN", o.in,
             "Calibration to read, of any supported format; two files separated by a comma", "FILE")
      ->required();
  add_option(command, "OUT", o.out, "File or files to write, or a directory for ROS", "FILE|DIR")
      ->required();
  add_option(command, "--to", o.to,
             "Format of OUT: vergence, kalibr, ros, opencv [by the name of OUT]", "NAME", "Output")
      ->check(one_of({"vergence", "kalibr", "ros", "opencv"}));
  add_flag(command, "--force", o.force, "Overwrite existing files", "Output");
  add_option(command, "--size", o.size, "Image size in pixels, if an OpenCV file has none: 640x480",
             "NxN", "Input");
  command.footer(
      "Example: vergence calibrate convert camchain.yaml calibration.yaml\n"
      "Exit codes: 0 success; 2 bad arguments or input.");
}

}  // namespace

CLI::App* CalibrateOptions::declare(CLI::App& root) {
  CLI::App* command = root.add_subcommand(
      "calibrate", "Calibrate from target images, live, or a sequence; convert formats");
  command->require_subcommand(1);
  command->footer(
      "Example: vergence calibrate sequence FOLDER --out calibration.yaml\n"
      "'vergence calibrate SUBCOMMAND --help' has options, an example and exit codes.");
  const auto add = [&](const char* name, const char* description, CalibrateCommand which,
                       void (*declare_options)(CLI::App&, CalibrateOptions&)) {
    CLI::App* sub = command->add_subcommand(name, description);
    declare_options(*sub, *this);
    sub->callback([this, which] { given = which; });
  };
  add("target", "Calibrate from image files of a calibration target", CalibrateCommand::target,
      declare_target);
  add("live", "Calibrate from a target shown to the cameras of a configuration",
      CalibrateCommand::live, declare_live);
  add("sequence", "Calibrate from a recorded sequence, without a target",
      CalibrateCommand::sequence, declare_sequence);
  add("convert", "Convert a calibration between vergence, Kalibr, ROS and OpenCV",
      CalibrateCommand::convert, declare_convert);
  return command;
}

void check_writable(const std::filesystem::path& file, bool force) {
  if (file.empty())
    throw InputError("--out is empty; name the file to write, e.g. calibration.yaml");
  const std::filesystem::path folder = file.has_parent_path() ? file.parent_path() : ".";
  if (std::filesystem::is_directory(file))
    throw InputError(file.string() +
                     ": is a directory; name the file to write, e.g. calibration.yaml");
  if (std::filesystem::exists(file) && !force)
    throw InputError(file.string() +
                     ": exists already; add --force to overwrite it, or name another file");
  if (::access(folder.c_str(), W_OK) != 0)
    throw InputError(folder.string() +
                     ": not writable; choose a file in an existing, writable directory");
}

}  // namespace vergence::app
