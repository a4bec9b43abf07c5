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
  CLI::App* command =
      root.add_subcommand("calibrate",
                          "Find lenses and places of the cameras with a checkerboard, from images "
                          "or live; convert other programs' files");
  command->add_option(
      "CONFIG", configuration,
      "Live: the cameras of this configuration, until nothing is missing or Ctrl-C");
  command
      ->add_option("--left", left,
                   "Images of the left camera, a pattern in quotes; alone: one camera's lens")
      ->type_name("GLOB");
  command
      ->add_option("--right", right,
                   "Images of the right camera, paired by number or order of name")
      ->type_name("GLOB");
  command->add_option("--camera", more_cameras, "Images of a third and a fourth camera")
      ->type_name("GLOB")
      ->allow_extra_args(false);
  command
      ->add_option(
          "--drive", drive,
          "An ordinary recorded drive instead of a board: lenses and places of the cameras")
      ->type_name("DATA");
  command
      ->add_option("--calibration", calibration,
                   "--drive: lenses and length to begin with, instead of the data set's own")
      ->type_name("FILE");
  declare_image_topics(*command, &left_topic, &right_topic);
  command->add_option("--checkerboard", board, "Inner corners along and down")->type_name("9x6");
  command
      ->add_option(
          "--aprilgrid", aprilgrid,
          "Instead of --checkerboard: tags along and up, family 36h11, as Kalibr prints them")
      ->type_name("6x6");
  command
      ->add_option("--charuco", charuco,
                   "Instead of --checkerboard: squares along and down of a ChArUco board")
      ->type_name("11x8");
  command->add_option("--square", square, "Side of a square, or of a tag, m")->type_name("M");
  command->add_option("--marker", marker, "--charuco: side of a marker, m")->type_name("M");
  command
      ->add_option("--dictionary", dictionary, "--charuco: the markers' dictionary, OpenCV's names")
      ->type_name("NAME")
      ->capture_default_str();
  command
      ->add_option("--spacing", spacing, "--aprilgrid: gap between two tags over the side of a tag")
      ->type_name("R")
      ->capture_default_str();
  command->add_option("--out", out, "calibration.yaml to write")->type_name("F");
  command
      ->add_option("--model", model,
                   "radtan: k1 k2 p1 p2; equidistant: k1 to k4, for fisheye lenses")
      ->check(CLI::IsMember({"radtan", "equidistant"}))
      ->capture_default_str();
  command->add_flag("--k3", sixth_order, "radtan: estimate k3, too");
  command
      ->add_option("--baseline", baseline,
                   "Distance of left and right as somebody measured it, m: reported against; "
                   "--drive: instead of the file's")
      ->type_name("M");
  command->add_flag("--json", json, "Print JSON instead of tables");
  command
      ->add_option("--keep-views", keep_views,
                   "Live: keep the images of the views taken, in a new folder")
      ->type_name("DIR");
  command
      ->add_option("--convert", convert,
                   "Convert a calibration: calibration.yaml, Kalibr camchain, ROS camera_info "
                   "(left.yaml,right.yaml or a folder with them), "
                   "OpenCV stereo YAML (one file, or intrinsics.yml,extrinsics.yml)")
      ->expected(2)
      ->type_name("IN OUT");
  command
      ->add_option(
          "--format", format,
          "--drive: the layout of DATA, as replay has it [auto]; --convert: the same as --to")
      ->type_name("WORD");
  command
      ->add_option("--to", to,
                   "--convert: format of OUT, where its name does not say: vergence, kalibr, "
                   "ros, opencv")
      ->type_name("WORD");
  command->add_flag("--force", force, "Overwrite a file that is there already");
  command->add_option("--size", size, "--convert: image size of an OpenCV file that has none")
      ->type_name("WxH");
  common.declare(*command);
  return command;
}

CalibrateWay CalibrateOptions::way() const {
  const int ways = (configuration.empty() ? 0 : 1) + (left.empty() ? 0 : 1) +
                   (convert.empty() ? 0 : 1) + (drive.empty() ? 0 : 1);
  if (ways != 1)
    throw InputError(
        "calibrate: give image files (--left, --right), a CONFIG with cameras, --drive DATA, or "
        "--convert IN OUT; one of them");
  if (!drive.empty()) return CalibrateWay::drive;
  if (!convert.empty()) return CalibrateWay::convert;
  return configuration.empty() ? CalibrateWay::board_images : CalibrateWay::board_live;
}

void check_writable(const std::filesystem::path& file, bool force) {
  const std::filesystem::path folder = file.has_parent_path() ? file.parent_path() : ".";
  if (std::filesystem::is_directory(file))
    throw InputError(file.string() +
                     ": is a folder; --out takes the file to write, calibration.yaml");
  if (std::filesystem::exists(file) && !force)
    throw InputError(
        file.string() +
        ": is there already, and nothing is overwritten; add --force, or name another file");
  if (::access(folder.c_str(), W_OK) != 0)
    throw InputError(folder.string() +
                     ": cannot be written to; --out takes a file in a folder that is there");
}

}  // namespace vergence::app
