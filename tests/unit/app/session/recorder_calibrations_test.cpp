#include <gtest/gtest.h>

#include <algorithm>
#include <thread>
#include <vector>

#include <nlohmann/json.hpp>

#include "app/session/recorder.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/unit/app/session/recorder_inputs.hpp"

namespace vergence::app {
namespace {

TEST(Recorder, calibrationsCarryTheirNumbersAndEmptyFieldsWhereNothingIsGiven) {
  const test::TemporaryFolder folder;
  Recorder recorder(folder.path(), {});
  recorder.on_calibration(
      CalibrationRecord::begin(two_cameras(), Stamp(kStamp), "given", "of a, file"));
  recorder.on_calibration(CalibrationRecord{decision(true)});
  recorder.on_calibration(CalibrationRecord{decision(false)});
  const auto totals = recorder.close();
  const auto lines = lines_of(folder / "calibrations.csv");
  ASSERT_EQ(lines.size(), 4U);
  EXPECT_EQ(lines[0], kCalibrationsHeader);
  const std::string numbers =
      ",1,0.000000000,0.000000000,0.000000000,-0.500000000,0.000000000,0.250000000,"
      "0.000100000,0.000200000,0.000300000,0.001000000,0.002000000,0.003000000,,,,,,,460.00000,461."
      "00000,320.00000,240.00000,";
  const std::string distortion = ",0.000000000,0.000000000,0.000000000,0.000000000,,,,";
  EXPECT_EQ(lines[1], "1403636584763555584,accepted,given,of a; file,0,,,0.0000,,,0.000000" +
                          numbers + ",,," + distortion + distortion + ",,,,,");
  EXPECT_EQ(lines[2],
            "1403636584763555584,accepted,knock,,60,71,840,0.1800,1.5000,0.1250,0.002000" +
                numbers + "0.200000000,0.300000000,0.000000000,0.000000000" + distortion +
                distortion + ",,,,,");
  EXPECT_EQ(lines[3].substr(0, 71),
            "1403636584763555584,rejected,knock,held-out frames do not fit better,60");
  for (const std::string& line : lines)
    EXPECT_EQ(std::count(lines[0].begin(), lines[0].end(), ','),
              std::count(line.begin(), line.end(), ','))
        << line;

  EXPECT_EQ(totals->accepted, 1U) << "what the drive begins with is no decision";
  EXPECT_EQ(totals->rejected, 1U);
  ASSERT_EQ(totals->attempts.size(), 2U);
  EXPECT_EQ(totals->attempts[0].cause, "knock");
  EXPECT_EQ(totals->attempts[0].latency_frames, 71);
  EXPECT_EQ(totals->attempts[1].reason, "held-out frames do not fit better");
}

EventRecord event_at(std::int64_t ns, EstimatorEvent::Kind kind, double value) {
  EstimatorEvent event;
  event.stamp = Stamp(ns);
  event.kind = kind;
  event.value = value;
  return EventRecord::of(event);
}

TEST(Recorder, acceptedCalibrationsAreKeptOnItsOwnThreadAndAFailureIsAnEventAndASentence) {
  for (const bool fails : {false, true}) {
    const test::TemporaryFolder folder;
    std::thread::id where;
    int calls = 0;
    Recorder::Options options;
    options.keep = [&](const RigCalibration& rig, bool found) {
      ++calls;
      EXPECT_TRUE(found);
      where = std::this_thread::get_id();
      EXPECT_EQ(rig.frames, 60);
      return Kept{fails, fails ? "state: no room" : "kept"};
    };
    Recorder recorder(folder.path(), options);
    recorder.on_calibration(CalibrationRecord::begin(two_cameras(), Stamp(kStamp), "given", ""));
    recorder.on_calibration(CalibrationRecord{decision(false)});
    recorder.on_calibration(CalibrationRecord{decision(true)});
    (void)recorder.close();
    EXPECT_EQ(calls, 1);
    EXPECT_NE(where, std::this_thread::get_id());
    const auto events = lines_of(folder / "events.jsonl");
    ASSERT_EQ(events.size(), 1U);
    const auto event = nlohmann::json::parse(events[0]);
    EXPECT_EQ(event["kind"], fails ? "calibration_save_failed" : "calibration_saved");
    EXPECT_EQ(recorder.take_errors().size(), fails ? 1U : 0U);
  }
}

TEST(Recorder, whatTheDriveBeganWithIsKeptOnceItIsConfirmedUnlessAnotherWasFoundBefore) {
  using Kind = EstimatorEvent::Kind;
  for (const bool found_before : {false, true}) {
    const test::TemporaryFolder folder;
    std::vector<bool> kept;
    Recorder::Options options;
    options.keep = [&kept](const RigCalibration& rig, bool found) {
      kept.push_back(found);
      EXPECT_EQ(rig.frames == 60, found) << "which of the two it is";
      return Kept{false, "kept"};
    };
    Recorder recorder(folder.path(), options);
    RigCalibration given = two_cameras();
    given.frames = 7;
    recorder.on_calibration(CalibrationRecord::begin(given, Stamp(kStamp), "given", "mine.yaml"));
    recorder.on_calibration(CalibrationRecord{decision(false)});
    if (found_before) recorder.on_calibration(CalibrationRecord{decision(true)});
    recorder.on_event(event_at(700, Kind::calibration_verified, 0.3));
    recorder.on_event(event_at(900, Kind::calibration_verified, 0.3));
    (void)recorder.close();
    EXPECT_EQ(kept, std::vector<bool>{found_before});
  }
}

}  // namespace
}  // namespace vergence::app
