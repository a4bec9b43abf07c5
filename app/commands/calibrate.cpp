#include <unistd.h>

#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "app/calibration/conversion.hpp"
#include "app/commands/calibrate_session.hpp"
#include "app/commands/commands.hpp"
#include "app/commands/common_options.hpp"
#include "app/commands/drive_calibration.hpp"
#include "app/commands/given_calibration.hpp"
#include "app/commands/replay_session.hpp"

namespace vergence::app {
namespace {

/// The words as given; checked when the command runs.
struct Arguments {
  CommonOptions common;
  std::string configuration, board, out, model = "radtan", format, size, drive;
  std::optional<std::string> calibration;
  std::vector<std::string> left, right, convert;
  std::vector<std::string> more_cameras;  // one pattern each
  std::optional<std::string> keep_views;
  std::optional<double> square, baseline;
  std::string to;
  bool sixth_order = false, json = false, force = false;
};

CameraModelKind parse_model(const std::string& word) {
  return word == "equidistant" ? CameraModelKind::pinhole_equidistant : CameraModelKind::pinhole_radtan;
}

/// Before the board is carried around for half an hour, not after it.
void check_writable(const std::filesystem::path& file, bool force) {
  const std::filesystem::path folder = file.has_parent_path() ? file.parent_path() : ".";
  if (std::filesystem::is_directory(file))
    throw InputError(file.string() + ": is a folder; --out takes the file to write, calibration.yaml");
  if (std::filesystem::exists(file) && !force)
    throw InputError(file.string() + ": is there already, and nothing is overwritten; add --force, or name another file");
  if (::access(folder.c_str(), W_OK) != 0)
    throw InputError(folder.string() + ": cannot be written to; --out takes a file in a folder that is there");
}

CalibrateRequest request_of(const Arguments& a) {
  if (a.board.empty()) throw InputError("--board is missing: the board's inner corners along and down, like 9x6");
  if (!a.square) throw InputError("--square is missing: the side of a square in metres, like 0.025");
  if (a.out.empty()) throw InputError("--out is missing: the calibration.yaml to write");
  if (a.baseline && !(*a.baseline > 0 && *a.baseline < 100)) throw InputError("--baseline needs metres, more than 0 and less than 100");
  if (a.sixth_order && a.model == "equidistant") throw InputError("--k3 belongs to radtan; equidistant has k1 to k4");
  CalibrateRequest r;
  r.board = parse_checkerboard(a.board, *a.square);
  r.model = parse_model(a.model);
  r.sixth_order = a.sixth_order;
  r.out = a.out;
  r.measured_baseline = a.baseline;
  if (a.keep_views) r.keep_views = *a.keep_views;
  r.json = a.json;
  r.quiet = a.common.quiet;
  check_writable(r.out, a.force);
  return r;
}

ExitCode convert(const Arguments& a) {
  ConversionRequest r;
  r.in = a.convert[0];
  r.out = a.convert[1];
  if (!a.to.empty() && !a.format.empty()) throw InputError("--to and --format both say what OUT is to be; give --to");
  if (!a.to.empty() || !a.format.empty()) r.format = parse_format(a.to.empty() ? a.format : a.to);
  const CalibrationFormat format = r.format ? *r.format : format_of_name(r.out);
  for (const std::filesystem::path& file : files_written(r.out, format))
    if (std::filesystem::exists(file) && !a.force)
      throw InputError(file.string() + ": is there already, and nothing is overwritten; add --force, or name another file");
  if (!a.size.empty()) r.size = parse_size(a.size);
  for (const std::string& sentence : convert_calibration(r)) std::cerr << "vergence: " << sentence << '\n';
  std::vector<std::string> written;
  for (const std::filesystem::path& file : files_written(r.out, format)) written.push_back(file.string());
  std::cerr << fmt::format("{}: written as {}\n", fmt::join(written, ", "), describe(format));
  return ExitCode::done;
}

/// An ordinary drive instead of a board.
ExitCode calibrate_from_drive(const Arguments& a) {
  if (a.out.empty()) throw InputError("--out is missing: the calibration.yaml to write");
  check_writable(a.out, a.force);
  const Configuration c = a.common.configuration(std::nullopt);
  const SequenceFormat format = sequence_format(a.format.empty() ? "auto" : a.format, a.drive);
  const CalibrationUse use{true, a.baseline.value_or(0)};
  std::vector<std::string> remarks;
  // Of what the drive comes with only lenses and length are read: how its cameras sit need not be known.
  const StereoSequence sequence = a.calibration ? open_sequence(format, a.drive, calibration_source(*a.calibration, use, &remarks), use)
                                                : open_sequence(format, a.drive, std::nullopt, use);
  for (const std::string& sentence : remarks) std::cerr << "vergence: " << sentence << '\n';
  check_image_sizes(sequence, 0, sequence.pairs.size());
  const StartingCalibration told = replayed_calibration(c, sequence, true);
  Progress progress = Progress::on_stderr(a.common.quiet);
  const DriveCalibration found = calibrate_with_progress({sequence, c, 0, sequence.pairs.size(), {}, {}}, told, &progress);
  if (!found.rig) {
    progress.say(fmt::format("vergence: {}: no calibration was found, nothing is written: {}", a.drive, found.why));
    return ExitCode::not_usable;
  }
  CalibrationFile written = told.file;
  written.rig = *found.rig;
  written.source = "drive";
  write_calibration(a.out, written);
  std::cout << describe(found);
  if (!found.verified)
    progress.say("vergence: the depth is not known well enough: a longer drive with turns, past things near the road, would help");
  progress.say(a.out + ": written");
  return found.verified ? ExitCode::done : ExitCode::not_usable;
}

ExitCode run(const Arguments& a) {
  const int ways = (a.configuration.empty() ? 0 : 1) + (a.left.empty() ? 0 : 1) + (a.convert.empty() ? 0 : 1) + (a.drive.empty() ? 0 : 1);
  if (ways != 1)
    throw InputError(
        "calibrate: give image files (--left, --right), a CONFIG with cameras, --drive DATA, or --convert IN OUT; one of them");
  if (!a.drive.empty()) return calibrate_from_drive(a);
  if (!a.convert.empty()) return convert(a);
  if (a.configuration.empty() && a.keep_views) throw InputError("--keep-views is for live views; image files are kept as they are");
  if (!a.configuration.empty()) {
    if (!a.right.empty() || !a.more_cameras.empty())
      throw InputError("calibrate: a CONFIG has its cameras; --right and --camera go with --left");
    return calibrate_live(request_of(a), a.common.configuration(a.configuration));
  }
  if (a.right.empty() && !a.more_cameras.empty()) throw InputError("--camera is for a third and fourth camera; --right comes first");
  std::vector<std::vector<std::string>> patterns{a.left};
  if (!a.right.empty()) patterns.push_back(a.right);
  for (const std::string& pattern : a.more_cameras) patterns.push_back({pattern});
  if (patterns.size() > kMaxCameras)
    throw InputError(fmt::format("a rig has up to {} cameras, {} are given", kMaxCameras, patterns.size()));
  return calibrate_images(request_of(a), patterns);
}

}  // namespace

void add_calibrate(CLI::App& root, ExitCode* exit_code) {
  const auto a = std::make_shared<Arguments>();
  CLI::App* command = root.add_subcommand(
      "calibrate", "Find lenses and places of the cameras with a checkerboard, from images or live; convert other programs' files");
  command->add_option("CONFIG", a->configuration, "Live: the cameras of this configuration, until nothing is missing or Ctrl-C");
  command->add_option("--left", a->left, "Images of the left camera, a pattern in quotes; alone: one camera's lens")->type_name("GLOB");
  command->add_option("--right", a->right, "Images of the right camera, paired by number or order of name")->type_name("GLOB");
  command->add_option("--camera", a->more_cameras, "Images of a third and a fourth camera")->type_name("GLOB")->allow_extra_args(false);
  command->add_option("--drive", a->drive, "An ordinary recorded drive instead of a board: lenses and places of the cameras")
      ->type_name("DATA");
  command->add_option("--calibration", a->calibration, "--drive: lenses and length to begin with, instead of the data set's own")
      ->type_name("FILE");
  command->add_option("--board", a->board, "Inner corners along and down")->type_name("9x6");
  command->add_option("--square", a->square, "Side of a square, m")->type_name("M");
  command->add_option("--out", a->out, "calibration.yaml to write")->type_name("F");
  command->add_option("--model", a->model, "radtan: k1 k2 p1 p2; equidistant: k1 to k4, for fisheye lenses")
      ->check(CLI::IsMember({"radtan", "equidistant"}))
      ->capture_default_str();
  command->add_flag("--k3", a->sixth_order, "radtan: estimate k3, too");
  command
      ->add_option("--baseline", a->baseline,
                   "Distance of left and right as somebody measured it, m: reported against; --drive: instead of the file's")
      ->type_name("M");
  command->add_flag("--json", a->json, "Print JSON instead of tables");
  command->add_option("--keep-views", a->keep_views, "Live: keep the images of the views taken, in a new folder")->type_name("DIR");
  command
      ->add_option(
          "--convert", a->convert,
          "Convert a calibration: calibration.yaml, Kalibr camchain, ROS camera_info (left.yaml,right.yaml or a folder with them), "
          "OpenCV stereo YAML (one file, or intrinsics.yml,extrinsics.yml)")
      ->expected(2)
      ->type_name("IN OUT");
  command->add_option("--format", a->format, "--drive: the layout of DATA, as replay has it [auto]; --convert: the same as --to")
      ->type_name("WORD");
  command->add_option("--to", a->to, "--convert: what OUT is to be, where its name does not tell: vergence, kalibr, ros, opencv")
      ->type_name("WORD");
  command->add_flag("--force", a->force, "Overwrite a file that is there already");
  command->add_option("--size", a->size, "--convert: image size of an OpenCV file that has none")->type_name("WxH");
  a->common.declare(*command);
  command->callback([a, exit_code] { *exit_code = run(*a); });
}

}  // namespace vergence::app
