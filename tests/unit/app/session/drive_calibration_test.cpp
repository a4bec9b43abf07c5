#include "app/session/drive_calibration.hpp"

#include <csignal>

#include <gtest/gtest.h>

namespace vergence::app {
namespace {

/// Frames that nobody can read: each pass is over at once.
StereoSequence unreadable() {
  StereoSequence sequence;
  sequence.root = "/none";
  for (int i = 0; i < 3; ++i) sequence.pairs.push_back({Stamp(i), {"left.png", "right.png"}, true});
  RigCalibration& rig = sequence.calibration;
  rig.cameras = 2;
  for (std::size_t k = 0; k < 2; ++k)
    rig.intrinsics[k] = {.width = 160, .height = 120, .fx = 100, .fy = 100, .cx = 80, .cy = 60};
  rig.T_camera_left[1].t = {-0.5, 0, 0};
  rig.baseline = 0.5;
  return sequence;
}

TEST(DriveCalibration, whatStopsItIsStillThereForWhoAskedForIt) {
  const StereoSequence sequence = unreadable();
  const Configuration configuration = load_configuration(std::nullopt, {});
  const StartingCalibration given = replayed_calibration(configuration, sequence, true);
  Progress progress = Progress::on_stderr(true);
  const SignalGuard signals;
  const DrivePass pass{sequence, configuration, 0, sequence.pairs.size(), {}, {}};
  DriveCalibration found = calibrate_with_progress(pass, given, signals, &progress);
  EXPECT_NE(found.why.find("no calibration was found"), std::string::npos) << found.why;
  std::raise(SIGTERM);
  found = calibrate_with_progress(pass, given, signals, &progress);
  EXPECT_FALSE(found.rig);
  EXPECT_EQ(found.why, "it was interrupted");
  EXPECT_EQ(signals.stop_code(), ExitCode::terminated);
}

}  // namespace
}  // namespace vergence::app
