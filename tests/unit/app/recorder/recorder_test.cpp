#include "app/recorder/recorder.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <sstream>
#include <thread>

#include <nlohmann/json.hpp>

#include "app/recorder/line_file.hpp"
#include "app/recorder/pose_line.hpp"
#include "app/runtime/errors.hpp"
#include "core/math/so3.hpp"
#include "core/memory/allocation_guard.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/unit/app/recorder/broken_descriptor.hpp"

namespace vergence::app {
namespace {

constexpr std::int64_t kStamp = 1403636584763555584;  // ns: a double loses its last digits

PoseRecord pose(std::uint64_t frame, PoseStatus status, double x) {
  PoseSample sample;
  sample.frame = frame;
  sample.stamp = Stamp(kStamp + static_cast<std::int64_t>(frame) * 50'000'000);
  sample.state = State::stereo_odometry;
  sample.status = status;
  sample.reason = status == PoseStatus::ok ? Reason::none : Reason::few_inliers;
  sample.T_world_left.t = {x, 0, 0};
  sample.inliers = 100;
  sample.reprojection_px = 0.25;
  sample.estimate_ms = 7.5F;
  return PoseRecord::of(sample, 2.0F, std::nullopt);
}

std::vector<std::string> lines_of(const std::filesystem::path& file) {
  std::istringstream in(test::read_file(file));
  std::vector<std::string> lines;
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

TEST(SessionFolder, isMadeOrTakenWhenEmptyAndRefusedOtherwise) {
  const test::TemporaryFolder folder;
  EXPECT_TRUE(make_session_folder(folder / "a/b/session"));
  EXPECT_TRUE(std::filesystem::is_directory(folder / "a/b/session"));
  EXPECT_FALSE(make_session_folder(folder / "a/b/session")) << "empty: taken";
  folder.write("a/b/session/notes.txt", "mine");
  EXPECT_THROW(make_session_folder(folder / "a/b/session"), InputError);
  EXPECT_THROW(make_session_folder(folder / "a/b/session/notes.txt"), InputError);
  EXPECT_THROW(make_session_folder(folder / "a/b/session/notes.txt/below"), InputError);
  EXPECT_THROW(make_session_folder(""), InputError);
  EXPECT_EQ(test::read_file(folder / "a/b/session/notes.txt"), "mine");
  discard_session_folder(folder / "a/b/session", false);
  EXPECT_TRUE(std::filesystem::is_empty(folder / "a/b/session")) << "as it was";
  discard_session_folder(folder / "a/b/session", true);
  EXPECT_FALSE(std::filesystem::exists(folder / "a/b/session"));
}

TEST(Recorder, posesGoToTheirFilesWithExactStampsAndLostOnesHaveNoPose) {
  const test::TemporaryFolder folder;
  Recorder recorder(folder.path(), {});
  PoseRecord first = pose(0, PoseStatus::ok, 0);
  first.has_reference = true;
  first.reference_left = {{1, 2, 3}, {0, 0, 0, 1}};
  recorder.post(first);
  recorder.post(pose(1, PoseStatus::lost, 9));
  recorder.post(pose(2, PoseStatus::degraded, 1.5));
  const auto totals = recorder.close();

  const auto tum = lines_of(folder / "trajectory.tum");
  ASSERT_EQ(tum.size(), 2U);
  EXPECT_EQ(tum[0],
            "1403636584.763555584 0.000000000 0.000000000 0.000000000 0.000000000 0.000000000 "
            "0.000000000 1.000000000");
  EXPECT_EQ(tum[1].substr(0, 32), "1403636584.863555584 1.500000000");
  const auto reference = lines_of(folder / "reference.tum");
  ASSERT_EQ(reference.size(), 1U);
  EXPECT_EQ(reference[0].substr(0, 54), "1403636584.763555584 1.000000000 2.000000000 3.0000000");

  const auto csv = lines_of(folder / "poses.csv");
  ASSERT_EQ(csv.size(), 4U);
  EXPECT_EQ(csv[0], kPosesHeader);
  for (const std::string& line : csv)
    EXPECT_EQ(std::count(line.begin(), line.end(), ','), 32) << line;  // 33 columns
  EXPECT_EQ(csv[2], "1,1403636584813555584,stereo_odometry,lost,few_inliers" +
                        std::string(26, ',') + "100,,7.500");
  EXPECT_EQ(csv[3].substr(0, 64),
            "2,1403636584863555584,stereo_odometry,degraded,few_inliers,1.500");

  EXPECT_EQ(totals->read, 3U);
  EXPECT_EQ(totals->ok, 1U);
  EXPECT_EQ(totals->degraded, 1U);
  EXPECT_EQ(totals->lost, 1U);
  EXPECT_DOUBLE_EQ(totals->path_m, 1.5);
  EXPECT_EQ(totals->trajectory.size(), 2U);
  EXPECT_NEAR(totals->decode.mean(), 2.0, 1e-9);
  EXPECT_TRUE(totals->faults.empty());
}

TEST(Recorder, itsOwnEventsBeforeTheFirstPoseAreOfTheDrivesBegin) {
  const test::TemporaryFolder folder;
  Recorder recorder(folder.path(), {.first = Stamp(kStamp)});
  recorder.reopen();
  (void)recorder.close();
  const auto lines = lines_of(folder / "events.jsonl");
  ASSERT_EQ(lines.size(), 1U);
  EXPECT_NE(lines[0].find(std::to_string(kStamp)), std::string::npos) << lines[0];
}

TEST(Recorder, eventsAreOneJsonObjectALineWhateverTheirText) {
  const test::TemporaryFolder folder;
  Recorder recorder(folder.path(), {});
  EventRecord event;
  event.stamp = Stamp(kStamp);
  event.kind = "image_torn";
  event.set_sentence("left/\"a\"\n\xff.png is torn");
  event.fields[0] = {"frame", std::int64_t{7}};
  event.fields[1] = {"seconds", 0.5};
  event.fields[2] = {"word", "late"};
  recorder.post(event);
  EstimatorEvent change;
  change.stamp = Stamp(kStamp);
  change.from = State::initialising;
  change.to = State::stereo_odometry;
  change.why = "trusted calibration";
  recorder.post(EventRecord::of(change));
  (void)recorder.close();
  const auto lines = lines_of(folder / "events.jsonl");
  ASSERT_EQ(lines.size(), 2U);
  const auto torn = nlohmann::json::parse(lines[0]), state = nlohmann::json::parse(lines[1]);
  EXPECT_EQ(torn["stamp_ns"], kStamp);
  EXPECT_EQ(torn["kind"], "image_torn");
  EXPECT_EQ(torn["fields"]["frame"], 7);
  EXPECT_EQ(torn["fields"]["seconds"], 0.5);
  EXPECT_EQ(torn["fields"]["word"], "late");
  EXPECT_EQ(state["kind"], "state");
  EXPECT_EQ(state["sentence"], "initialising to stereo_odometry: trusted calibration");
  EXPECT_EQ(state["fields"]["to"], "stereo_odometry");
}

TEST(EventRecord, aLongSentenceIsCutBetweenCharacters) {
  EventRecord event;
  event.set_sentence(std::string(254, 'a').append("é and more"));  // the é would straddle the end
  const std::string kept = event.sentence.data();
  EXPECT_EQ(kept, std::string(254, 'a'));
}

RigCalibration two_cameras() {
  RigCalibration rig;
  rig.cameras = 2;
  for (std::size_t k = 0; k < 2; ++k)
    rig.intrinsics[k] = {.width = 640, .height = 480, .fx = 460, .fy = 461, .cx = 320, .cy = 240};
  rig.T_camera_left[1].t = {-0.5, 0, 0.25};
  rig.sigma_noise[1] = {1e-4, 2e-4, 3e-4, 0.001, 0.002, 0.003};
  return rig;
}

CalibrationDecision decision(bool accepted) {
  CalibrationDecision d;
  d.stamp = Stamp(kStamp);
  d.cause = CalibrationCause::knock;
  d.accepted = accepted;
  d.reason = accepted ? "" : "held-out frames do not fit better";
  d.calibration = two_cameras();
  d.calibration.frames = 60;
  d.calibration.reprojection_px = 0.18;
  d.calibration.scale_sigma = 0.002;
  d.calibration.intrinsics[1].sigma = {0.2, 0.3, 0, 0};
  d.latency_frames = 71;
  d.onset_frame = 840;
  d.held_out_before_px = 1.5;
  d.held_out_after_px = 0.125;
  d.solve_ms = 33;
  return d;
}

TEST(Recorder, calibrationsCarryTheirNumbersAndEmptyFieldsWhereNothingIsGiven) {
  const test::TemporaryFolder folder;
  Recorder recorder(folder.path(), {});
  recorder.post(CalibrationRecord::begin(two_cameras(), Stamp(kStamp), "given", "of a, file"));
  recorder.post(CalibrationRecord::of(decision(true)));
  recorder.post(CalibrationRecord::of(decision(false)));
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

TEST(Recorder, whatTheDriveMeasuredWhileItWentOnIsKeptAndNoAttempt) {
  const test::TemporaryFolder folder;
  Recorder recorder(folder.path(), {});
  CalibrationDecision measured = decision(false);
  measured.cause = CalibrationCause::refinement;
  measured.learnt = true;
  measured.judged_depth_m = 20;
  measured.depth_sigma_percent = 0.25;
  measured.depth_difference_percent = 1.5;
  measured.verified = measured.lenses = true;
  recorder.post(CalibrationRecord::of(measured));
  const auto totals = recorder.close();
  const auto lines = lines_of(folder / "calibrations.csv");
  ASSERT_EQ(lines.size(), 2U);
  EXPECT_EQ(lines[1].substr(0, 40), "1403636584763555584,kept,refinement,held");
  EXPECT_TRUE(lines[1].ends_with(",20.00,0.2500,1.5000,1,1")) << lines[1];
  EXPECT_EQ(totals->rejected, 0U);
  EXPECT_TRUE(totals->attempts.empty());
}

TEST(TotalsBuilder, theFirstCalibrationFoundIsKnownAlsoAfterThousandsOfAttempts) {
  TotalsBuilder builder(0);
  const auto attempt = [&builder](CalibrationCause cause, bool accepted) {
    CalibrationDecision d = decision(accepted);
    d.cause = cause;
    return builder.add(CalibrationRecord::of(d));
  };
  for (std::size_t i = 0; i < kMostAttempts + 5; ++i)
    EXPECT_FALSE(attempt(CalibrationCause::from_scratch, false));
  EXPECT_TRUE(attempt(CalibrationCause::from_scratch, true));
  for (std::size_t i = 0; i < kMostAttempts + 5; ++i)
    EXPECT_FALSE(attempt(CalibrationCause::knock, false));
  const SessionTotals& totals = builder.totals();
  ASSERT_TRUE(totals.from_scratch.found);
  EXPECT_EQ(totals.from_scratch.rejected, kMostAttempts + 5);
  EXPECT_EQ(totals.attempts.size(), kMostAttempts);
}

EventRecord event_at(std::int64_t ns, EstimatorEvent::Kind kind, double value) {
  EstimatorEvent event;
  event.stamp = Stamp(ns);
  event.kind = kind;
  event.value = value;
  return EventRecord::of(event);
}

TEST(Recorder, theFirstConfirmationAndTheFirstContradictionAreInTheTotals) {
  using Kind = EstimatorEvent::Kind;
  for (const bool after_the_pose :
       {false, true}) {  // at the end of a drive the event comes after the last pose
    const test::TemporaryFolder folder;
    Recorder recorder(folder.path(), {});
    PoseSample sample;
    sample.frame = 7, sample.stamp = Stamp(700);
    recorder.post(event_at(700, Kind::calibration_contradicted, 6.5));
    if (after_the_pose) recorder.post(PoseRecord::of(sample, 0, std::nullopt));
    recorder.post(event_at(700, Kind::calibration_confirmed, 0.3));
    if (!after_the_pose) recorder.post(PoseRecord::of(sample, 0, std::nullopt));
    recorder.post(event_at(900, Kind::calibration_contradicted, 1.0));
    recorder.post(event_at(900, Kind::calibration_confirmed, 0.3));
    sample.frame = 9, sample.stamp = Stamp(900);
    recorder.post(PoseRecord::of(sample, 0, std::nullopt));
    const auto totals = recorder.close();
    EXPECT_EQ(totals->confirmed, Stamp(700));
    EXPECT_EQ(totals->confirmed_frame, 7U);
    ASSERT_TRUE(totals->contradicted);
    EXPECT_EQ(totals->contradicted->stamp, Stamp(700));
    EXPECT_EQ(totals->contradicted->depth_percent, 6.5);
  }
}

TEST(RigNumbers, thereAndBackAreTheSameDoubles) {
  RigCalibration rig = two_cameras();
  rig.cameras = 3;
  rig.T_camera_left[2] = {exp_so3({0.1, -0.2, 0.3}), Vec3(-0.1, 0.2, 0.3)};
  rig.covariance_wide[2] = Mat6::Identity() * 3e-7;
  rig.covariance_wide[2](1, 4) = rig.covariance_wide[2](4, 1) = 1e-8;
  rig.baseline = 0.559;
  rig.baseline_sigma = 0.001;
  rig.found = Stamp(kStamp);
  const RigCalibration again = RigNumbers::of(rig).rig();
  EXPECT_EQ(again.cameras, 3);
  EXPECT_EQ(again.T_camera_left[2].R, rig.T_camera_left[2].R);
  EXPECT_EQ(again.T_camera_left[2].t, rig.T_camera_left[2].t);
  EXPECT_EQ(again.covariance_wide[2], rig.covariance_wide[2]);
  EXPECT_EQ(again.intrinsics[1].fy, 461);
  EXPECT_EQ(again.sigma_noise, rig.sigma_noise);
  EXPECT_EQ(again.baseline_sigma, 0.001);
  EXPECT_EQ(again.found, rig.found);
}

TEST(Recorder, acceptedCalibrationsAreKeptOnItsOwnThreadAndAFailureIsAnEventAndASentence) {
  for (const bool fails : {false, true}) {
    const test::TemporaryFolder folder;
    std::thread::id where;
    int calls = 0;
    Recorder::Options options;
    options.keep = [&](const RigCalibration& rig) {
      ++calls;
      where = std::this_thread::get_id();
      EXPECT_EQ(rig.frames, 60);
      return Kept{fails, fails ? "state: no room" : "kept"};
    };
    Recorder recorder(folder.path(), options);
    recorder.post(CalibrationRecord::begin(two_cameras(), Stamp(kStamp), "given", ""));
    recorder.post(CalibrationRecord::of(decision(false)));
    recorder.post(CalibrationRecord::of(decision(true)));
    (void)recorder.close();
    EXPECT_EQ(calls, 1);
    EXPECT_NE(where, std::this_thread::get_id());
    const auto events = lines_of(folder / "events.jsonl");
    ASSERT_EQ(events.size(), 1U);
    const auto event = nlohmann::json::parse(events[0]);
    EXPECT_EQ(event["kind"], fails ? "calibration_not_kept" : "calibration_kept");
    EXPECT_EQ(recorder.take_errors().size(), fails ? 1U : 0U);
  }
}

TEST(EventRecord, whatHappensToACalibrationIsAWholeSentence) {
  EstimatorEvent event;
  event.kind = EstimatorEvent::Kind::calibration_rejected;
  event.why = "too little motion";
  EXPECT_STREQ(EventRecord::of(event).sentence.data(),
               "a calibration was rejected: too little motion");
  event.kind = EstimatorEvent::Kind::calibration_confirmed;
  event.why = "the drive confirms it";
  EXPECT_STREQ(EventRecord::of(event).sentence.data(), "the drive confirms it");
  event.kind = EstimatorEvent::Kind::calibration_contradicted;
  event.why = "it is not that of the rig";
  event.value = 6.54;
  EXPECT_STREQ(EventRecord::of(event).sentence.data(),
               "it is not that of the rig: its depths are off by 6.5 %");
  event.kind = EstimatorEvent::Kind::rig_changed;
  event.why = "the rig no longer fits";
  EXPECT_STREQ(EventRecord::of(event).sentence.data(), "the rig no longer fits");
}

TEST(Recorder, framesOfOtherStatesThanOdometryAreTimedByThemselves) {
  const test::TemporaryFolder folder;
  Recorder recorder(folder.path(), {});
  const std::array states{State::initialising,    State::parallel_monocular, State::calibrating,
                          State::stereo_odometry, State::recalibrating,      State::lost};
  for (std::size_t i = 0; i < states.size(); ++i) {
    PoseRecord p = pose(i, PoseStatus::ok, 0);
    p.state = states[i];
    p.estimate_ms = static_cast<float>(i + 1);
    recorder.post(p);
  }
  const auto totals = recorder.close();
  EXPECT_EQ(totals->calibrating.count(), 4U);
  EXPECT_DOUBLE_EQ(totals->calibrating.mean(), (1 + 2 + 3 + 5) / 4.0);
}

TEST(Recorder, theSameRecordsGiveTheSameBytes) {
  std::array<std::string, 2> bytes;
  for (std::string& b : bytes) {
    const test::TemporaryFolder folder;
    Recorder recorder(folder.path(), {});
    for (std::uint64_t i = 0; i < 500; ++i)
      recorder.post(pose(i, i % 7 == 3 ? PoseStatus::lost : PoseStatus::ok,
                         std::sin(static_cast<double>(i))));
    (void)recorder.close();
    b = test::read_file(folder / "trajectory.tum") + test::read_file(folder / "poses.csv") +
        test::read_file(folder / "events.jsonl");
  }
  EXPECT_EQ(bytes[0], bytes[1]);
}

TEST(Recorder, nothingIsLostWhenTheProducerOutrunsTheDisk) {
  const test::TemporaryFolder folder;
  Recorder recorder(folder.path(), {});
  constexpr std::uint64_t kFrames = 20000;
  for (std::uint64_t i = 0; i < kFrames; ++i) recorder.post(pose(i, PoseStatus::ok, 0));
  const auto totals = recorder.close();
  EXPECT_EQ(totals->read, kFrames);
  EXPECT_EQ(totals->dropped_records, 0U);
  EXPECT_EQ(lines_of(folder / "poses.csv").size(), kFrames + 1);
}

TEST(Recorder, liveDropsAreCountedAndNeverMakeTheProducerWait) {
  const test::TemporaryFolder folder;
  Recorder recorder(folder.path(),
                    {.when_full = Recorder::WhenFull::drop, .keep_trajectory = false});
  constexpr std::uint64_t kFrames = 20000;
  for (std::uint64_t i = 0; i < kFrames; ++i) recorder.post(pose(i, PoseStatus::ok, 0));
  const auto totals = recorder.close();
  EXPECT_EQ(totals->read + totals->dropped_records, kFrames);
  EXPECT_TRUE(totals->trajectory.empty());
}

TEST(Recorder, whatWasPostedIsInTheFilesWhileTheSessionGoesOn) {
  const test::TemporaryFolder folder;
  Recorder recorder(folder.path(), {});
  recorder.post(pose(0, PoseStatus::ok, 0));
  bool found = false;
  for (int i = 0; i < 200 && !found; ++i) {  // two seconds at most, one is promised
    found = lines_of(folder / "trajectory.tum").size() == 1;
    if (!found) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  EXPECT_TRUE(found);
}

TEST(Recorder, aFullDiskIsASentenceAndTheOtherFilesAreWhole) {
  const test::TemporaryFolder folder;
  std::filesystem::create_symlink("/dev/full", folder / "poses.csv");
  Recorder recorder(folder.path(), {});
  for (std::uint64_t i = 0; i < 10; ++i) recorder.post(pose(i, PoseStatus::ok, 0));
  const auto totals = recorder.close();
  const auto errors = recorder.take_errors();
  ASSERT_EQ(errors.size(), 1U);  // once, not for every line
  EXPECT_NE(errors[0].find("poses.csv"), std::string::npos);
  ASSERT_EQ(totals->faults.size(), 1U);
  EXPECT_NE(totals->faults[0].find("poses.csv: is not complete"), std::string::npos)
      << totals->faults[0];
  EXPECT_EQ(lines_of(folder / "trajectory.tum").size(), 10U);
  EXPECT_EQ(totals->read, 10U);
}

/// Sentences of the events of one kind.
std::vector<std::string> told(const std::filesystem::path& folder, const std::string& kind) {
  std::vector<std::string> sentences;
  for (const std::string& line : lines_of(folder / "events.jsonl")) {
    const auto event = nlohmann::json::parse(line);
    if (event["kind"] == kind) sentences.push_back(event["sentence"]);
  }
  return sentences;
}

/// Frames [first, last) of a drive find the disk full.
std::function<bool(Stamp)> full_from_to(std::uint64_t first, std::uint64_t last) {
  return [=](Stamp s) {
    return s >= Stamp(kStamp + static_cast<std::int64_t>(first) * 50'000'000) &&
           s < Stamp(kStamp + static_cast<std::int64_t>(last) * 50'000'000);
  };
}

TEST(Recorder, statusesAreOfTheFileThatTheTrajectoryIsInAtTheEnd) {
  const test::TemporaryFolder folder;
  Recorder recorder(folder.path(), {});
  for (std::uint64_t i = 0; i < 5; ++i) recorder.post(pose(i, PoseStatus::degraded, 0.1));
  while (lines_of(folder / "trajectory.tum").size() < 5)
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  std::filesystem::rename(folder / "trajectory.tum", folder / "trajectory.tum.1");
  recorder.reopen();
  while (told(folder.path(), "files_reopened").empty())
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  for (std::uint64_t i = 5; i < 8; ++i) recorder.post(pose(i, PoseStatus::ok, 0.1));
  const auto totals = recorder.close();
  EXPECT_EQ(totals->statuses, std::vector<PoseStatus>(3, PoseStatus::ok));
  EXPECT_EQ(totals->trajectory.size(), 3U);
  EXPECT_EQ(totals->degraded, 5U) << "counts are of all";
}

TEST(Recorder, aDiskThatIsFullForAWhileCostsNothingThatMemoryHolds) {
  const test::TemporaryFolder folder;
  Recorder::Options options;
  options.disk_full = full_from_to(20, 40);
  Recorder recorder(folder.path(), options);
  for (std::uint64_t i = 0; i < 100; ++i)
    recorder.post(pose(i, PoseStatus::ok, 0.1 * static_cast<double>(i)));
  const auto totals = recorder.close();
  EXPECT_TRUE(totals->faults.empty());
  EXPECT_EQ(totals->lost_lines, 0U);
  EXPECT_EQ(lines_of(folder / "trajectory.tum").size(), 100U);
  EXPECT_EQ(lines_of(folder / "poses.csv").size(), 101U);
  EXPECT_EQ(told(folder.path(), "disk_full"),
            std::vector<std::string>{"the disk of the session has no room: lines wait in memory"});
  EXPECT_EQ(told(folder.path(), "disk_room"),
            std::vector<std::string>{"the disk takes lines again; 0 were lost"});
  const auto full = nlohmann::json::parse(lines_of(folder / "events.jsonl").front());
  EXPECT_EQ(full["stamp_ns"], kStamp + 20 * std::int64_t{50'000'000});
  const auto errors = recorder.take_errors();
  EXPECT_TRUE(std::any_of(errors.begin(), errors.end(), [](const std::string& c) {
    return c.find("the disk has no room, as the drive's faults want it; the session goes on") !=
           std::string::npos;
  }));
}

TEST(Recorder, aDiskThatIsFullForLongLosesWholeLinesAndSaysHowMany) {
  const test::TemporaryFolder folder;
  constexpr std::uint64_t kFrames = 14'000;  // 170 bytes each in poses.csv: twice what memory holds
  Recorder::Options options;
  options.disk_full = full_from_to(10, kFrames - 10);
  Recorder recorder(folder.path(), options);
  for (std::uint64_t i = 0; i < kFrames; ++i)
    recorder.post(pose(i, PoseStatus::ok, 0.1 * static_cast<double>(i)));
  const auto totals = recorder.close();
  EXPECT_TRUE(totals->faults.empty()) << "the files end whole: the session is usable";
  ASSERT_GT(totals->lost_lines, 1000U);
  const std::size_t written =
      lines_of(folder / "trajectory.tum").size() + lines_of(folder / "poses.csv").size() - 1;
  EXPECT_EQ(written + totals->lost_lines, 2 * kFrames);
  EXPECT_EQ(told(folder.path(), "disk_room"),
            std::vector<std::string>{"the disk takes lines again; " +
                                     std::to_string(totals->lost_lines) + " were lost"});
  const auto errors = recorder.take_errors();
  EXPECT_TRUE(std::any_of(errors.begin(), errors.end(), [](const std::string& c) {
    return c.find("lines that found no room on the disk in time; the others are all there") !=
           std::string::npos;
  }));
}

TEST(Recorder, aDiskThatIsMountedAgainGoesOnWithTheLinesThatWaited) {
  const test::TemporaryFolder folder;
  const std::filesystem::path session = folder / "session", away = folder / "away";
  std::filesystem::create_directory(session);
  Recorder recorder(session, {});
  const auto post = [&recorder](std::uint64_t first, std::uint64_t end) {
    for (std::uint64_t i = first; i < end; ++i)
      recorder.post(pose(i, PoseStatus::ok, 0.1 * static_cast<double>(i)));
  };
  const auto has_lines = [](const std::filesystem::path& file, std::size_t lines) {
    for (int i = 0; i < 1000; ++i) {
      if (lines_of(file).size() == lines) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return false;
  };
  post(0, 5);
  ASSERT_TRUE(has_lines(session / "trajectory.tum", 5));
  ASSERT_TRUE(has_lines(session / "poses.csv", 6));
  std::filesystem::rename(session, away);
  for (const char* file : {"trajectory.tum", "poses.csv", "events.jsonl"})
    ASSERT_EQ(test::break_descriptors_of(away / file), 1) << file;
  post(5, 10);
  std::vector<std::string> errors;
  for (int i = 0; i < 500 && errors.empty(); ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    errors = recorder.take_errors();
  }
  ASSERT_FALSE(errors.empty());
  EXPECT_NE(errors[0].find("check that disk"), std::string::npos) << errors[0];
  std::filesystem::rename(away, session);
  for (std::uint64_t i = 10; i < 10'000 && lines_of(session / "poses.csv").size() == 6; ++i) {
    post(i, i + 1);
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  const auto totals = recorder.close();
  EXPECT_TRUE(totals->faults.empty());
  EXPECT_EQ(totals->lost_lines, 0U);
  EXPECT_EQ(lines_of(session / "trajectory.tum").size(), totals->read);
  EXPECT_EQ(lines_of(session / "poses.csv").size(), totals->read + 1);
  EXPECT_EQ(told(session, "disk_full").size(), 1U);
  EXPECT_EQ(told(session, "disk_room").size(), 1U);
}

TEST(Recorder, aDiskThatIsFullToTheEndLeavesFilesThatAreNotWholeAndNamesThem) {
  const test::TemporaryFolder folder;
  Recorder::Options options;
  options.disk_full = full_from_to(10, 1'000'000);
  Recorder recorder(folder.path(), options);
  for (std::uint64_t i = 0; i < 100; ++i)
    recorder.post(pose(i, PoseStatus::ok, 0.1 * static_cast<double>(i)));
  const auto totals = recorder.close();
  EXPECT_GE(totals->faults.size(), 2U);
  EXPECT_EQ(lines_of(folder / "trajectory.tum").size(), 10U);
}

TEST(Recorder, aFolderThatCannotBeWrittenIsNamed) {
  const test::TemporaryFolder folder;
  EXPECT_THROW(Recorder(folder / "none", {}), InputError);
}

TEST(Recorder, postingAllocatesNothing) {
  if (!AllocationGuard::available())
    GTEST_SKIP() << "needs the allocation hooks, which sanitizer builds leave out";
  const test::TemporaryFolder folder;
  Recorder recorder(folder.path(), {});
  EstimatorEvent event;
  event.why = "a state changed";
  const CalibrationDecision made = decision(false);
  const auto before = AllocationGuard::allocations_after_seal();
  {
    const SealedScope sealed;
    for (std::uint64_t i = 0; i < 1000; ++i) {
      recorder.post(pose(i, PoseStatus::ok, 0));
      recorder.post(EventRecord::of(event));
      recorder.post(CalibrationRecord::of(made));
    }
  }
  EXPECT_EQ(AllocationGuard::allocations_after_seal(), before);
}

}  // namespace
}  // namespace vergence::app
