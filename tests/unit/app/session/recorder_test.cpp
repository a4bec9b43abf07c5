#include "app/session/recorder.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <future>

#include <nlohmann/json.hpp>

#include "app/runtime/durable_file.hpp"
#include "app/runtime/errors.hpp"
#include "app/session/session_quota.hpp"
#include "tests/support/within.hpp"
#include "tests/unit/app/session/recorder_inputs.hpp"

namespace vergence::app {
namespace {

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

TEST(Recorder, stampsAreExactAndLostFramesHaveNoPose) {
  const test::TemporaryFolder folder;
  Recorder recorder(folder.path(), {});
  FrameReport first = pose(0, PoseStatus::ok, 0);
  first.T_reference_left = Transform{Mat3::Identity(), {1, 2, 3}};
  recorder.on_report(first);
  recorder.on_report(pose(1, PoseStatus::lost, 9));
  recorder.on_report(pose(2, PoseStatus::degraded, 1.5));
  const auto totals = recorder.close();

  const auto tum = test::read_lines(folder / "trajectory.tum");
  ASSERT_EQ(tum.size(), 2U);
  EXPECT_EQ(tum[0],
            "1403636584.763555584 0.000000000 0.000000000 0.000000000 0.000000000 0.000000000 "
            "0.000000000 1.000000000");
  EXPECT_EQ(tum[1].substr(0, 32), "1403636584.863555584 1.500000000");
  const auto reference = test::read_lines(folder / "reference.tum");
  ASSERT_EQ(reference.size(), 1U);
  EXPECT_EQ(reference[0].substr(0, 54), "1403636584.763555584 1.000000000 2.000000000 3.0000000");

  const auto csv = test::read_lines(folder / "poses.csv");
  ASSERT_EQ(csv.size(), 4U);
  EXPECT_EQ(csv[0], kPosesHeader);
  for (const std::string& line : csv)
    // There are 33 columns.
    EXPECT_EQ(std::count(line.begin(), line.end(), ','), 32) << line;
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

TEST(Recorder, eventsAreOneJsonObjectALineWhateverTheirText) {
  const test::TemporaryFolder folder;
  Recorder recorder(folder.path(), {});
  EventRecord event;
  event.stamp = Stamp(kStamp);
  event.kind = "image_truncated";
  event.set_message("left/\"a\"\n\xff.png is truncated");
  event.fields[0] = {"frame", std::int64_t{7}};
  event.fields[1] = {"seconds", 0.5};
  event.fields[2] = {"rating", "late"};
  event.fields[3] = {"whole", 2.0};
  recorder.on_event(event);
  EstimatorEvent change;
  change.stamp = Stamp(kStamp);
  change.from = State::initialising;
  change.to = State::stereo_odometry;
  change.why = "trusted calibration";
  recorder.on_event(EventRecord::of(change));
  change.kind = EstimatorEvent::Kind::time_gap;
  change.value = 2.5;
  recorder.on_event(EventRecord::of(change));
  (void)recorder.close();
  const auto lines = test::read_lines(folder / "events.jsonl");
  ASSERT_EQ(lines.size(), 3U);
  const auto truncated = nlohmann::json::parse(lines[0]), state = nlohmann::json::parse(lines[1]);
  EXPECT_EQ(truncated["stamp_ns"], kStamp);
  EXPECT_EQ(truncated["kind"], "image_truncated");
  EXPECT_EQ(truncated["fields"]["frame"], 7);
  EXPECT_EQ(truncated["fields"]["seconds"], 0.5);
  EXPECT_EQ(truncated["fields"]["rating"], "late");
  EXPECT_TRUE(truncated["fields"]["whole"].is_number_float()) << lines[0];
  EXPECT_EQ(state["kind"], "state");
  EXPECT_EQ(state["message"], "initialising to stereo_odometry: trusted calibration");
  EXPECT_EQ(state["fields"]["to"], "stereo_odometry");
  EXPECT_EQ(nlohmann::json::parse(lines[2])["fields"], nlohmann::json({{"gap_s", 2.5}}));
}

TEST(Recorder, liveDropsAreCountedAndNeverMakeTheProducerWait) {
  const test::TemporaryFolder folder;
  std::promise<void> posted;
  Recorder::Options options{.when_full = WhenFull::drop, .keep_trajectory = false};
  // The recorder's thread hangs at the first pose until all are posted. A producer that waited for
  // it would do so until it is let go after all, and nothing would be dropped.
  options.disk_full = [all_posted = posted.get_future().share(), hung = false](Stamp) mutable {
    if (!std::exchange(hung, true)) (void)all_posted.wait_for(std::chrono::seconds(10));
    return false;
  };
  Recorder recorder(folder.path(), options);
  // This is several times the capacity of the queue.
  constexpr std::uint64_t kFrames = 5000;
  for (std::uint64_t i = 0; i < kFrames; ++i) recorder.on_report(pose(i, PoseStatus::ok, 0));
  posted.set_value();
  const auto totals = recorder.close();
  EXPECT_GT(totals->dropped_records, 0U);
  EXPECT_GT(totals->read, 0U);
  EXPECT_EQ(totals->read + totals->dropped_records, kFrames);
  EXPECT_EQ(test::read_lines(folder / "poses.csv").size(), totals->read + 1);
  EXPECT_TRUE(totals->trajectory.empty());
}

TEST(Recorder, whatWasPostedIsInTheFilesWhileTheSessionGoesOn) {
  const test::TemporaryFolder folder;
  Recorder recorder(folder.path(), {});
  recorder.on_report(pose(0, PoseStatus::ok, 0));
  // One second is promised.
  EXPECT_TRUE(
      test::within(2, [&] { return test::read_lines(folder / "trajectory.tum").size() == 1; }));
}

/// Sentences of the events of one kind.
std::vector<std::string> reported(const std::filesystem::path& folder, const std::string& kind) {
  std::vector<std::string> messages;
  for (const std::string& line : test::read_lines(folder / "events.jsonl")) {
    const auto event = nlohmann::json::parse(line);
    if (event["kind"] == kind) messages.push_back(event["message"]);
  }
  return messages;
}

/// Frames [first, last) of a drive find the disk full.
std::function<bool(Stamp)> full_from_to(std::uint64_t first, std::uint64_t last) {
  return [=](Stamp s) {
    return s >= Stamp(kStamp + static_cast<std::int64_t>(first) * 50'000'000) &&
           s < Stamp(kStamp + static_cast<std::int64_t>(last) * 50'000'000);
  };
}

TEST(Recorder, brieflyFullDiskLosesNothing) {
  const test::TemporaryFolder folder;
  Recorder recorder(folder.path(), {.disk_full = full_from_to(20, 40)});
  for (std::uint64_t i = 0; i < 100; ++i)
    recorder.on_report(pose(i, PoseStatus::ok, 0.1 * static_cast<double>(i)));
  const auto totals = recorder.close();
  EXPECT_TRUE(totals->faults.empty());
  EXPECT_EQ(totals->lost_lines, 0U);
  EXPECT_EQ(test::read_lines(folder / "trajectory.tum").size(), 100U);
  EXPECT_EQ(test::read_lines(folder / "poses.csv").size(), 101U);
  EXPECT_EQ(reported(folder.path(), "disk_full").size(), 1U);
  EXPECT_EQ(reported(folder.path(), "disk_recovered"),
            std::vector<std::string>{"lines are written again; 0 were lost"});
  const auto full = nlohmann::json::parse(test::read_lines(folder / "events.jsonl").front());
  EXPECT_EQ(full["stamp_ns"], kStamp + 20 * std::int64_t{50'000'000});
  const auto errors = recorder.pop_errors();
  ASSERT_EQ(errors.size(), 1U) << "once, not for every file";
  EXPECT_NE(errors[0].find("No space left on device"), std::string::npos) << errors[0];
}

TEST(Recorder, longFullDiskLosesWholeCountedLines) {
  const test::TemporaryFolder folder;
  // At 170 bytes each in poses.csv, this is twice what memory holds.
  constexpr std::uint64_t kFrames = 14'000;
  Recorder recorder(folder.path(), {.disk_full = full_from_to(10, kFrames - 10)});
  for (std::uint64_t i = 0; i < kFrames; ++i)
    recorder.on_report(pose(i, PoseStatus::ok, 0.1 * static_cast<double>(i)));
  const auto totals = recorder.close();
  EXPECT_EQ(totals->faults.size(), 2U) << "trajectory.tum and poses.csv lack lines";
  ASSERT_GT(totals->lost_lines, 1000U);
  const std::size_t written = test::read_lines(folder / "trajectory.tum").size() +
                              test::read_lines(folder / "poses.csv").size() - 1;
  EXPECT_EQ(written + totals->lost_lines, 2 * kFrames);
  EXPECT_EQ(reported(folder.path(), "disk_recovered"),
            std::vector<std::string>{"lines are written again; " +
                                     std::to_string(totals->lost_lines) + " were lost"});
}

TEST(LineFile, moreThanMayWaitIsHandedOverWhileTheDiskTakesIt) {
  const test::TemporaryFolder folder;
  LineFile file(folder / "a.txt", 16);
  std::string all;
  for (int i = 10; i < 50; ++i) {
    const std::string line = "line " + std::to_string(i) + '\n';
    EXPECT_TRUE(file.append(line)) << i;
    all += line;
  }
  EXPECT_TRUE(file.close());
  EXPECT_EQ(file.lost_lines(), 0U);
  EXPECT_EQ(test::read_file(folder / "a.txt"), all);
}

namespace fs = std::filesystem;

TEST(SessionQuota, removesOldestEndedSessions) {
  const test::TemporaryFolder folder;
  const auto make = [&](const std::string& name, bool ended, int age_h) {
    fs::create_directories(folder / name);
    folder.write(name + "/poses.csv", std::string(600, 'x'));
    if (!ended) return;
    folder.write(name + "/summary.json", std::string(400, 'x'));
    fs::last_write_time(folder / name / "summary.json",
                        fs::file_time_type::clock::now() - std::chrono::hours(age_h));
  };
  make("oldest", true, 3);
  make("older", true, 2);
  make("new", true, 1);
  make("cut_off", false, 0);
  make("now", true, 9);
  fs::create_directories(folder / "photos");
  folder.write("photos/summary.json", std::string(5000, 'x'));
  EXPECT_TRUE(keep_session_quota(folder / "now", 3000).empty()) << "three sessions of 1000 bytes";
  EXPECT_EQ(keep_session_quota(folder / "now/", 1500).size(), 2U);
  for (const char* removed : {"oldest", "older"})
    EXPECT_FALSE(fs::exists(folder / removed)) << removed;
  for (const char* stays : {"new", "cut_off", "now", "photos"})
    EXPECT_TRUE(fs::exists(folder / stays)) << stays;
  EXPECT_TRUE(keep_session_quota(folder / "nowhere" / "now", 0).empty());
}

}  // namespace
}  // namespace vergence::app
