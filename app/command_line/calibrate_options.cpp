#include "app/command_line/calibrate_options.hpp"

#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <iostream>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>

#include "app/runtime/errors.hpp"

namespace vergence::app {

namespace fs = std::filesystem;

std::optional<fs::path> find_checkerboard_tool(const fs::path& folder) {
  for (const fs::path& place :
       {folder / kCheckerboardTool, folder.parent_path() / "libexec/vergence" / kCheckerboardTool})
    if (::access(place.c_str(), X_OK) == 0) return place;
  return std::nullopt;
}

ExitCode run_checkerboard_tool(const ProgramWords& words) {
  const fs::path folder = fs::read_symlink("/proc/self/exe").parent_path();
  const auto tool = find_checkerboard_tool(folder);
  if (!tool)
    throw InputError(fmt::format(
        "calibrate: this needs {0}, which is not installed (looked beside the program in {1}, and "
        "in {2}); install the package "
        "{0}, or build "
        "it: scripts/setup",
        kCheckerboardTool, folder.string(), (folder.parent_path() / "libexec/vergence").string()));
  std::vector<char*> argv;
  for (const char* word : words) argv.push_back(const_cast<char*>(word));  // execv() only reads
  argv.push_back(nullptr);
  std::cout.flush();
  ::execv(tool->c_str(), argv.data());
  throw InputError(fmt::format("{}: cannot be started: {}", tool->string(), std::strerror(errno)));
}

CLI::App* CalibrateOptions::declare(CLI::App& root) {
  CLI::App* command = root.add_subcommand(
      "calibrate", "Calibrate from target images, live, or a sequence; convert formats");
  command->add_option("CONFIG", configuration,
                      "Live calibration with the cameras of this configuration");
  command
      ->add_option("--left", left,
                   "Images of the left camera, quoted; alone: one camera's intrinsics")
      ->type_name("GLOB");
  command->add_option("--right", right, "Images of the right camera, paired by number or name")
      ->type_name("GLOB");
  command->add_option("--camera", more_cameras, "Images of a third and a fourth camera")
      ->type_name("GLOB")
      ->allow_extra_args(false);
  command->add_option("--drive", drive, "Calibrate from a recorded sequence, without a target")
      ->type_name("DATA");
  command
      ->add_option("--calibration", calibration,
                   "--drive: initial calibration instead of the data set's")
      ->type_name("FILE");
  declare_image_topics(*command, &left_topic, &right_topic);
  command->add_option("--checkerboard", board, "Inner corners of a checkerboard, columns and rows")
      ->type_name("9x6");
  command->add_option("--aprilgrid", aprilgrid, "Tags of an AprilGrid (36h11), columns and rows")
      ->type_name("6x6");
  command->add_option("--charuco", charuco, "Squares of a ChArUco target, columns and rows")
      ->type_name("11x8");
  command->add_option("--square", square, "Size of a square or tag in metres")->type_name("M");
  command->add_option("--marker", marker, "--charuco: size of a marker in metres")->type_name("M");
  command->add_option("--dictionary", dictionary, "--charuco: OpenCV's name of the dictionary")
      ->type_name("NAME")
      ->capture_default_str();
  command->add_option("--spacing", spacing, "--aprilgrid: gap between tags relative to their size")
      ->type_name("R")
      ->capture_default_str();
  command->add_option("--out", out, "Calibration file to write")->type_name("FILE");
  command->add_option("--model", model, "Lens model: radtan, or equidistant (fisheye)")
      ->check(CLI::IsMember({"radtan", "equidistant"}))
      ->capture_default_str();
  command->add_flag("--k3", sixth_order, "radtan: also estimate k3");
  command
      ->add_option("--baseline", baseline,
                   "Measured baseline in metres; printed for comparison, with --drive used")
      ->type_name("M");
  command->add_flag("--json", json, "Print JSON instead of tables");
  command->add_option("--keep-views", keep_views, "Live: save the images of accepted views")
      ->type_name("DIR");
  command
      ->add_option("--convert", convert,
                   "Convert a calibration between vergence, Kalibr, ROS and OpenCV")
      ->expected(2)
      ->type_name("IN OUT");
  command->add_option("--format", format, "--drive: format of DATA [auto]; --convert: same as --to")
      ->type_name("FORMAT");
  command
      ->add_option("--to", to,
                   "--convert: format of OUT: vergence, kalibr, ros, opencv [by its name]")
      ->type_name("FORMAT");
  command->add_flag("--force", force, "Overwrite existing files");
  command->add_option("--size", size, "--convert: image size, if an OpenCV file has none")
      ->type_name("WxH");
  command->footer(
      "Examples:\n"
      "  vergence calibrate --drive DATA --out calibration.yaml\n"
      "  vergence calibrate --left 'l*.png' --right 'r*.png' --checkerboard 9x6 --square 0.025 "
      "--out F.yaml\n"
      "  vergence calibrate --convert camchain.yaml calibration.yaml\n"
      "Exit codes: 0 success; 1 no usable calibration; 2 bad arguments or input; 3 camera "
      "missing;\n"
      "130 Ctrl-C.");
  common.declare(*command);
  return command;
}

CalibrateWay CalibrateOptions::way() const {
  const int ways = (configuration.empty() ? 0 : 1) + (left.empty() ? 0 : 1) +
                   (convert.empty() ? 0 : 1) + (drive.empty() ? 0 : 1);
  if (ways != 1)
    throw InputError(
        "calibrate: pass exactly one of: image files (--left, --right), CONFIG (live), --drive "
        "DATA, --convert IN OUT");
  if (!drive.empty()) return CalibrateWay::drive;
  if (!convert.empty()) return CalibrateWay::convert;
  return configuration.empty() ? CalibrateWay::board_images : CalibrateWay::board_live;
}

void check_writable(const std::filesystem::path& file, bool force) {
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
