#include "app/session/calibrate_drive.hpp"

#include <array>
#include <iostream>
#include <vector>

#include <fmt/format.h>

#include "app/session/drive_calibration.hpp"
#include "app/session/given_calibration.hpp"
#include "app/session/starting_calibration.hpp"

namespace vergence::app {

ExitCode calibrate_from_drive(const DriveCalibrationRequest& r) {
  const Configuration& c = r.configuration;
  const CalibrationUse use{true, r.baseline.value_or(0)};
  std::vector<std::string> remarks;
  // Of what the drive comes with only lenses and length are read: how its cameras sit need not be
  // known.
  const std::array cameras{c.kitti_raw.left, c.kitti_raw.right};
  const StereoSequence sequence =
      r.calibration
          ? open_sequence(r.format, r.data, given_calibration(*r.calibration, use, &remarks), use,
                          cameras, r.topics)
          : open_sequence(r.format, r.data, std::nullopt, use, cameras, r.topics);
  for (const std::string& sentence : remarks) std::cerr << "vergence: " << sentence << '\n';
  check_image_sizes(sequence, 0, sequence.pairs.size());
  const StartingCalibration given = replayed_calibration(c, sequence, true);
  const SignalGuard signals;
  Progress progress = Progress::on_stderr(r.quiet);
  for (const std::string& sentence : sequence.remarks) progress.say("vergence: " + sentence);
  if (!sequence.assumptions.empty())
    progress.say(fmt::format("vergence: assumed: {}", fmt::join(sequence.assumptions, "; ")));
  const DriveCalibration found = calibrate_with_progress(
      {sequence, c, 0, sequence.pairs.size(), {}, {}}, given, signals, &progress);
  if (!found.rig) {
    progress.say(fmt::format("vergence: {}: no calibration was found, nothing is written: {}",
                             r.data.string(), found.why));
    return signals.stop_code().value_or(ExitCode::not_usable);
  }
  CalibrationFile written = given.file;
  written.rig = *found.rig;
  written.source = "drive";
  write_calibration(r.out, written);
  std::cout << describe(found);
  if (!found.verified)
    progress.say(
        "vergence: the depth is not known well enough: a longer drive with turns, past things near "
        "the road, would help");
  progress.say(r.out.string() + ": written");
  return found.verified ? ExitCode::done : ExitCode::not_usable;
}

}  // namespace vergence::app
