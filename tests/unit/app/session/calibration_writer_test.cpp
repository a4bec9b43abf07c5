#include "app/session/calibration_writer.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/unit/app/session/recorder_inputs.hpp"

namespace vergence::app {
namespace {

std::vector<std::string> close(CalibrationWriter* writer, const RigCalibration* in_use = nullptr) {
  std::vector<std::string> faults;
  writer->close(in_use, &faults);
  return faults;
}

TEST(CalibrationWriter, emptyFieldsReplaceMissingNumbers) {
  const test::TemporaryFolder folder;
  CalibrationWriter writer({.session = folder.path()});
  writer.on_calibration(
      CalibrationRecord::begin(two_cameras(), Stamp(kStamp), "given", "of a, file"));
  writer.on_calibration(CalibrationRecord{decision(true)});
  writer.on_calibration(CalibrationRecord{decision(false)});
  close(&writer);
  const CalibrationTotals& totals = writer.totals();
  const auto lines = test::read_lines(folder / "calibrations.csv");
  ASSERT_EQ(lines.size(), 4U);
  EXPECT_EQ(lines[0], kCalibrationsHeader);
  const std::string numbers =
      ",1,0.000000000,0.000000000,0.000000000,-0.500000000,0.000000000,0.250000000,"
      "0.000100000,0.000200000,0.000300000,0.001000000,0.002000000,0.003000000,,,,,,,460.00000,461."
      "00000,320.00000,240.00000,";
  const std::string distortion = ",0.000000000,0.000000000,0.000000000,0.000000000,,,,";
  EXPECT_EQ(lines[1], "1403636584763555584,accepted,given,of a; file,0,,,0.0000,,,0.000000" +
                          numbers + ",,," + distortion + distortion + ",,,,");
  EXPECT_EQ(lines[2],
            "1403636584763555584,accepted,knock,,60,71,840,0.1800,1.5000,0.1250,0.002000" +
                numbers + "0.200000000,0.300000000,0.000000000,0.000000000" + distortion +
                distortion + ",,,,");
  EXPECT_EQ(lines[3].substr(0, 71),
            "1403636584763555584,rejected,knock,held-out frames do not fit better,60");
  for (const std::string& line : lines)
    EXPECT_EQ(std::count(lines[0].begin(), lines[0].end(), ','),
              std::count(line.begin(), line.end(), ','))
        << line;

  EXPECT_EQ(totals.accepted, 1U) << "what the drive begins with is no decision";
  EXPECT_EQ(totals.rejected, 1U);
  ASSERT_EQ(totals.attempts.size(), 2U);
  EXPECT_EQ(totals.attempts[0].cause, "knock");
  EXPECT_EQ(totals.attempts[0].latency_frames, 71);
  EXPECT_EQ(totals.attempts[1].reason, "held-out frames do not fit better");
}

RigCalibration rig_from(int frames) {
  RigCalibration rig = two_cameras();
  rig.baseline = rig.T_camera_left[1].t.norm();
  rig.frames = frames;
  return rig;
}

CalibrationRecord begun() {
  return CalibrationRecord::begin(rig_from(7), Stamp(kStamp), "given", "mine.yaml");
}

CalibrationRecord found(bool accepted) {
  CalibrationDecision d = decision(accepted);
  d.calibration.baseline = d.calibration.T_camera_left[1].t.norm();
  return CalibrationRecord{d};
}

EventRecord verified() {
  EventRecord event;
  event.kind = "calibration_verified";
  return event;
}

TEST(CalibrationWriter, savesFoundOrVerifiedForNextDrive) {
  struct Row {
    bool confirms, finds;
    /// Frames of the calibration in the state file; 0 if there is none.
    int frames;
  };
  for (const auto& [confirms, finds, frames] :
       {Row{false, false, 0}, {true, false, 7}, {false, true, 60}, {true, true, 60}}) {
    const test::TemporaryFolder folder;
    const auto state = folder / "state/state.yaml";
    CalibrationWriter writer({.session = folder.path(), .state = state});
    writer.on_calibration(begun());
    writer.on_calibration(found(false));
    if (finds) writer.on_calibration(found(true));
    if (confirms) writer.on_event(verified());
    EXPECT_EQ(close(&writer), std::vector<std::string>{});
    EXPECT_EQ(std::filesystem::exists(state) ? read_calibration(state).rig.frames : 0, frames);
    const CalibrationFile in_session = read_calibration(folder / "calibration.yaml");
    EXPECT_EQ(in_session.rig.frames, finds ? 60 : 7);
    EXPECT_EQ(in_session.source, finds ? "online" : "");
    EventRecord event;
    EXPECT_EQ(writer.next(&event), frames > 0);
    if (frames > 0) {
      EXPECT_STREQ(event.kind, "calibration_saved");
    }
    EXPECT_FALSE(writer.next(&event)) << "what was replaced or kept is not kept again";
  }
}

TEST(CalibrationWriter, sessionHoldsCalibrationInUse) {
  const test::TemporaryFolder folder;
  CalibrationWriter writer({.session = folder.path()});
  writer.on_calibration(begun());
  writer.on_calibration(found(true));
  const RigCalibration taken_up_again = rig_from(7);
  EXPECT_TRUE(close(&writer, &taken_up_again).empty());
  EXPECT_EQ(read_calibration(folder / "calibration.yaml").rig.frames, 7);
}

TEST(CalibrationWriter, reportsWhetherNextDriveHasIt) {
  struct Row {
    bool session_fails, has_state, state_fails, failed;
  };
  for (const auto& [session_fails, has_state, state_fails, failed] :
       {Row{false, true, false, false},
        {false, true, true, true},
        {true, true, true, true},
        {true, true, false, false},
        // The session's file is the only one to write.
        {true, false, false, true}}) {
    const test::TemporaryFolder folder;
    const auto block = [&](const char* file) {
      std::filesystem::create_directories(folder / (std::string(file) + ".new"));
    };
    if (session_fails) block("calibration.yaml");
    if (state_fails) block("state.yaml");
    CalibrationWriter writer(
        {.session = folder.path(),
         .state = has_state ? std::optional(folder / "state.yaml") : std::nullopt});
    writer.on_calibration(found(true));
    EXPECT_EQ(close(&writer).size(), session_fails ? 1U : 0U);
    EventRecord event;
    ASSERT_TRUE(writer.next(&event));
    EXPECT_STREQ(event.kind, failed ? "calibration_save_failed" : "calibration_saved");
    EXPECT_EQ(std::string(event.message.data()).find("calibration.yaml") != std::string::npos,
              session_fails);
  }
}

}  // namespace
}  // namespace vergence::app
