#include <iostream>
#include <memory>
#include <optional>
#include <string>

#include <fmt/format.h>

#include "app/commands/calibrate_options.hpp"
#include "app/commands/checkerboard_tool.hpp"
#include "app/commands/commands.hpp"
#include "app/commands/drive_calibration.hpp"
#include "app/commands/given_calibration.hpp"
#include "app/commands/replay_session.hpp"

namespace vergence::app {
namespace {

/// An ordinary drive instead of a board.
ExitCode calibrate_from_drive(const CalibrateOptions& a) {
  if (a.out.empty()) throw InputError("--out is missing: the calibration.yaml to write");
  check_writable(a.out, a.force);
  const Configuration c = a.common.configuration(std::nullopt);
  const SequenceFormat format = sequence_format(a.format.empty() ? "auto" : a.format, a.drive);
  const CalibrationUse use{true, a.baseline.value_or(0)};
  std::vector<std::string> remarks;
  // Of what the drive comes with only lenses and length are read: how its cameras sit need not be
  // known.
  const std::array cameras{c.kitti_raw.left, c.kitti_raw.right};
  const StereoSequence sequence =
      a.calibration ? open_sequence(format, a.drive,
                                    given_calibration(*a.calibration, use, &remarks), use, cameras)
                    : open_sequence(format, a.drive, std::nullopt, use, cameras);
  for (const std::string& sentence : remarks) std::cerr << "vergence: " << sentence << '\n';
  check_image_sizes(sequence, 0, sequence.pairs.size());
  const StartingCalibration given = replayed_calibration(c, sequence, true);
  Progress progress = Progress::on_stderr(a.common.quiet);
  for (const std::string& sentence : sequence.remarks) progress.say("vergence: " + sentence);
  const DriveCalibration found =
      calibrate_with_progress({sequence, c, 0, sequence.pairs.size(), {}, {}}, given, &progress);
  if (!found.rig) {
    progress.say(fmt::format("vergence: {}: no calibration was found, nothing is written: {}",
                             a.drive, found.why));
    return ExitCode::not_usable;
  }
  CalibrationFile written = given.file;
  written.rig = *found.rig;
  written.source = "drive";
  write_calibration(a.out, written);
  std::cout << describe(found);
  if (!found.verified)
    progress.say(
        "vergence: the depth is not known well enough: a longer drive with turns, past things near "
        "the road, would help");
  progress.say(a.out + ": written");
  return found.verified ? ExitCode::done : ExitCode::not_usable;
}

}  // namespace

void add_calibrate(CLI::App& root, const ProgramWords& words, ExitCode* exit_code) {
  const auto a = std::make_shared<CalibrateOptions>();
  a->declare(root)->callback([a, words, exit_code] {
    *exit_code =
        a->way() == CalibrateWay::drive ? calibrate_from_drive(*a) : run_checkerboard_tool(words);
  });
}

}  // namespace vergence::app
