#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <functional>
#include <memory>
#include <thread>

#include <nlohmann/json.hpp>

#include "app/recorder/pose_line.hpp"
#include "app/recorder/recorder.hpp"
#include "app/recorder/session_folder.hpp"
#include "app/runtime/disk_errors.hpp"
#include "app/runtime/errors.hpp"
#include "tests/support/small_disk.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/unit/app/recorder/broken_descriptor.hpp"
#include "tests/unit/app/recorder/recorder_inputs.hpp"

namespace vergence::app {
namespace {

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

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)  // which take what they want

/// The process has so many bytes more than it has now, while it lives.
class LittleMemory {
 public:
  explicit LittleMemory(std::size_t more) {
    std::size_t pages = 0;
    std::ifstream("/proc/self/statm") >> pages;
    (void)::getrlimit(RLIMIT_AS, &before_);
    const rlimit little{pages * static_cast<std::size_t>(::sysconf(_SC_PAGESIZE)) + more,
                        before_.rlim_max};
    (void)::setrlimit(RLIMIT_AS, &little);
  }
  ~LittleMemory() { (void)::setrlimit(RLIMIT_AS, &before_); }
  LittleMemory(const LittleMemory&) = delete;
  LittleMemory& operator=(const LittleMemory&) = delete;

 private:
  rlimit before_{};
};

TEST(Recorder, aTrajectoryThatIsTooLongForTheMemoryIsASentenceAndTheTotalsAreThere) {
  constexpr std::size_t kLong = std::size_t{256} << 20, kMemory = std::size_t{32} << 20;  // bytes
  const test::TemporaryFolder folder;
  Recorder recorder(folder.path(), {});
  for (std::uint64_t i = 0; i < 5; ++i) recorder.post(pose(i, PoseStatus::ok, 0.1));
  while (lines_of(folder / "trajectory.tum").size() < 5)
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  std::filesystem::resize_file(folder / "trajectory.tum", kLong);
  std::unique_ptr<SessionTotals> totals;
  {
    const LittleMemory memory(kMemory);
    totals = recorder.close();
  }
  EXPECT_EQ(totals->ok, 5U);
  EXPECT_TRUE(totals->trajectory.empty());
  const auto errors = recorder.take_errors();
  ASSERT_EQ(errors.size(), 1U);
  EXPECT_NE(errors[0].find("trajectory.tum: is too long for this machine's memory"),
            std::string::npos)
      << errors[0];
}

#endif

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

/// A drive of so many frames whose disk is away where the folder is to be made; `then` is done
/// before the last of them.
struct AwayAtTheStart {
  std::unique_ptr<SessionTotals> totals;
  std::vector<std::string> errors;
};
AwayAtTheStart drive_with_disk_away(const std::filesystem::path& session,
                                    const std::function<void()>& then) {
  bool made = false;
  Recorder::Options options;
  options.number = 7;
  options.disk_away = LineFile::Away::wait;
  options.folder_fault = try_session_folder(session, &made);
  EXPECT_TRUE(made) << "it was not there before";
  EXPECT_TRUE(disk_is_away(options.folder_fault)) << options.folder_fault;
  Recorder recorder(session, options);
  recorder.post(pose(0, PoseStatus::ok, 0));
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  then();
  for (std::uint64_t i = 1; i < 10; ++i) recorder.post(pose(i, PoseStatus::ok, 0.1));
  AwayAtTheStart drive;
  drive.totals = recorder.close();
  drive.errors = recorder.take_errors();
  return drive;
}

TEST(Recorder, aDiskThatIsFullAtTheBeginningHasEveryLineWhenThereIsRoom) {
  const test::TemporaryFolder folder;
  const test::SmallDisk disk(folder.path(), "nr_inodes=1");
  if (!disk.ready()) GTEST_SKIP() << "no file system may be mounted here";
  const auto session = folder / "sessions" / "monday";
  EXPECT_THROW((void)make_session_folder(session), InputError);
  const auto drive =
      drive_with_disk_away(session, [&] { ASSERT_TRUE(disk.change("nr_inodes=100")); });
  EXPECT_TRUE(drive.totals->faults.empty());
  EXPECT_TRUE(drive.errors.empty()) << drive.errors.front();
  EXPECT_EQ(lines_of(session / "poses.csv").size(), 11U);
  EXPECT_EQ(lines_of(session / "poses.csv").front(), kPosesHeader);
  EXPECT_EQ(lines_of(session / "trajectory.tum").size(), 10U);
  EXPECT_EQ(drive.totals->statuses.size(), 10U);
  EXPECT_EQ(told(session, "disk_full").size(), 1U);
  EXPECT_EQ(test::read_file(session / SessionMark::kFile), "7\n");
}

TEST(Recorder, aDiskThatIsReadOnlyToTheEndIsAFaultOfEveryFile) {
  const test::TemporaryFolder folder;
  const test::SmallDisk disk(folder.path(), "");
  if (!disk.ready() || !disk.make_read_only()) GTEST_SKIP() << "no file system may be mounted here";
  const auto drive = drive_with_disk_away(folder / "monday", [] {});
  ASSERT_GE(drive.totals->faults.size(), 4U);
  EXPECT_NE(drive.totals->faults[0].find("is not complete (Read-only file system)"),
            std::string::npos)
      << drive.totals->faults[0];
  EXPECT_EQ(drive.totals->ok, 10U);
}

TEST(Recorder, aFolderOnADiskThatTakesNoNewFileIsASentenceForEach) {
  const test::TemporaryFolder folder;
  const test::SmallDisk disk(folder.path(), "nr_inodes=1");
  if (!disk.ready()) GTEST_SKIP() << "no file system may be mounted here";
  EXPECT_THROW(Recorder(folder.path(), {}), InputError);
  Recorder::Options options;
  options.disk_away = LineFile::Away::wait;
  Recorder recorder(folder.path(), options);
  recorder.post(pose(0, PoseStatus::ok, 0));
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  ASSERT_TRUE(disk.change("nr_inodes=100"));
  const auto totals = recorder.close();
  EXPECT_TRUE(totals->faults.empty());
  const auto errors = recorder.take_errors();
  ASSERT_FALSE(errors.empty());
  EXPECT_NE(errors[0].find("make room on that disk"), std::string::npos) << errors[0];
  EXPECT_EQ(lines_of(folder / "poses.csv").size(), 2U);
}

TEST(Recorder, aSessionIsLockedUntilItsRecorderGoes) {
  const test::TemporaryFolder folder;
  const auto is_free = [&folder] {
    const int fd = ::open(folder.path().c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    const bool locked = ::flock(fd, LOCK_EX | LOCK_NB) != 0;
    (void)::close(fd);
    return !locked;
  };
  {
    Recorder recorder(folder.path(), {});
    EXPECT_FALSE(is_free());
    recorder.reopen();
    while (told(folder.path(), "files_reopened").empty())
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    EXPECT_FALSE(is_free());
    (void)recorder.close();
    EXPECT_FALSE(is_free()) << "summary and report are to come";
  }
  EXPECT_TRUE(is_free());
}

}  // namespace
}  // namespace vergence::app
