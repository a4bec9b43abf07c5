// SIGHUP on a drive: the files are opened again, unless the terminal has gone. SIGTERM before it.
#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <thread>

#include "tests/support/temporary_folder.hpp"
#include "tests/system/run/live_drive.hpp"
#include "tests/system/run/session.hpp"

namespace vergence {
namespace {

using namespace std::chrono_literals;
namespace fs = std::filesystem;

using test::Drive;
using test::head_of;
using test::lines_of;
using test::within;

TEST(Hangup, theFilesOfADriveThatWereMovedAwayBeginAnewAndNoPoseIsLost) {
  const test::TemporaryFolder folder;
  const fs::path session = folder / "s";
  Drive drive(session, false, 600);
  ASSERT_TRUE(within(60s, [&] { return lines_of(session / "poses.csv") > 5; }));
  fs::rename(session / "poses.csv", session / "poses.csv.1");
  fs::rename(session / "events.jsonl", session / "events.jsonl.1");
  drive.signal(SIGHUP);
  ASSERT_TRUE(within(30s, [&] { return lines_of(session / "poses.csv") > 5; }));
  drive.signal(SIGTERM);
  EXPECT_EQ(drive.wait(), 143);
  EXPECT_EQ(head_of(session / "poses.csv"), head_of(session / "poses.csv.1"));
  EXPECT_EQ(test::events(session, "files_reopened").size(), 1U);
  const auto summary = test::summary_of(session);
  EXPECT_EQ(lines_of(session / "poses.csv") + lines_of(session / "poses.csv.1"),
            summary["frames"]["read"].get<std::size_t>() + 2);
  EXPECT_TRUE(fs::exists(session / "report.html"));
  EXPECT_TRUE(fs::exists(session / "drive_1.mcap")) << "the recording goes on in a new file";
}

// Devices take seconds to open, a mock's world to build: who stops it then has no session.
TEST(Stop, beforeTheDriveBeganLeavesNoFolder) {
  const test::TemporaryFolder folder;
  Drive drive(folder / "s", false, 600);
  std::this_thread::sleep_for(100ms);
  drive.signal(SIGTERM);
  EXPECT_EQ(drive.wait(), 143);
  EXPECT_FALSE(fs::exists(folder / "s"));
}

TEST(Hangup, aTerminalThatIsThereStopsNothingAndOneThatGoesClosesTheSession) {
  const test::TemporaryFolder folder;
  const fs::path session = folder / "s";
  Drive drive(session, true, 600);
  ASSERT_TRUE(within(60s, [&] { return lines_of(session / "poses.csv") > 5; }));
  drive.signal(SIGHUP);
  ASSERT_TRUE(within(30s, [&] { return !test::events(session, "files_reopened").empty(); }));
  drive.close_terminal();
  EXPECT_EQ(drive.wait(), 143);
  EXPECT_TRUE(fs::exists(session / "summary.json"));
  EXPECT_TRUE(fs::exists(session / "report.html"));
}

}  // namespace
}  // namespace vergence
