#include <gtest/gtest.h>

#include <functional>

#include <nlohmann/json.hpp>

#include "app/session/recorder.hpp"
#include "tests/unit/app/session/recorder_inputs.hpp"

namespace vergence::app {
namespace {

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

}  // namespace
}  // namespace vergence::app
