#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "app/commands/commands.hpp"
#include "app/commands/common_options.hpp"
#include "app/commands/replay_session.hpp"
#include "app/runtime/nearest.hpp"

namespace vergence::app {
namespace {

/// The words as given; checked when the command runs.
struct Arguments {
  CommonOptions common;
  std::string data, format, out;
  std::optional<std::string> calibration, also;
  std::int64_t start = 0;
  std::optional<std::int64_t> frames;
  std::optional<double> baseline;
  bool from_scratch = false, calibrate_first = false, memory = false;
};

}  // namespace

SequenceFormat sequence_format(const std::string& word) {
  if (word == "kitti") return SequenceFormat::kitti;
  if (word == "kitti-raw") return SequenceFormat::kitti_raw;
  if (word == "euroc") return SequenceFormat::euroc;
  if (word == "folder") return SequenceFormat::folder;
  if (word == "st-lucia") return SequenceFormat::st_lucia;
  if (word == "session")
    throw InputError("--format session is not there yet in this version; kitti, kitti-raw, euroc, folder and st-lucia are");
  throw InputError("--format \"" + word + "\" is not known" +
                   did_you_mean(word, {"kitti", "kitti-raw", "euroc", "folder", "st-lucia", "session"}) +
                   "; kitti, kitti-raw, euroc, folder and st-lucia are what can be read");
}

namespace {

ReplayRequest request_of(const Arguments& a) {
  if (a.baseline && !(*a.baseline >= 0.005 && *a.baseline <= 20))
    throw InputError("--baseline is the distance of the two cameras in metres, 0.005 to 20");
  if (a.start < 0) throw InputError("--start is the number of a frame, 0 or more");
  if (a.frames && *a.frames < 1) throw InputError("--frames needs at least 1");
  ReplayRequest r;
  r.data = a.data;
  r.format = sequence_format(a.format);
  if (a.calibrate_first && a.from_scratch)
    throw InputError("--calibrate-first begins from scratch, and drives with what it finds; leave --from-scratch away");
  r.out = a.out;
  if (a.calibration) r.calibration = *a.calibration;
  r.baseline = a.baseline;
  r.from_scratch = a.from_scratch;
  r.calibrate_first = a.calibrate_first;
  r.start = static_cast<std::size_t>(a.start);
  if (a.frames) r.frames = static_cast<std::size_t>(*a.frames);
  r.configuration = a.common.configuration(std::nullopt);
  r.quiet = a.common.quiet;
  if (a.also) r.also = parse_other_formats(*a.also);
  r.print_memory = a.memory;
  return r;
}

}  // namespace

void add_replay(CLI::App& root, ExitCode* exit_code) {
  const auto a = std::make_shared<Arguments>();
  CLI::App* command = root.add_subcommand("replay", "Run a recorded drive through the estimator and write a session folder");
  command->add_option("DATA", a->data, "Folder of the data set")->required();
  command->add_option("--format", a->format, "Layout of DATA: kitti, kitti-raw, euroc, folder, st-lucia (session comes later)")
      ->required()
      ->type_name("NAME");
  command->add_option("--out", a->out, "Session folder; must not exist or be empty")->required()->type_name("DIR");
  command->add_option("--calibration", a->calibration, "calibration.yaml to use instead of the data set's own")->type_name("FILE");
  command->add_option("--start", a->start, "First frame, from 0")->type_name("K");
  command->add_option("--frames", a->frames, "At most so many frames")->type_name("N");
  command->add_option("--baseline", a->baseline, "Distance of the two cameras in metres, instead of the calibration's")->type_name("M");
  command->add_flag("--from-scratch", a->from_scratch,
                    "Find the calibration from the drive itself: only intrinsics and the baseline's length are read");
  command->add_flag("--calibrate-first", a->calibrate_first,
                    "Calibrate from the whole drive, lenses included, then drive with what was found (twice the drive more)");
  declare_also(*command, &a->also);
  command->add_flag("--memory", a->memory, "Print what memory is held, by whom");
  a->common.declare(*command);
  command->callback([a, exit_code] { *exit_code = run_replay(request_of(*a)); });
}

}  // namespace vergence::app
