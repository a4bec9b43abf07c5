// SIGTERM before a drive has begun, SIGHUP in the middle of it.
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
using test::lines_of;
using test::within;

// Devices take seconds to open, a mock's world to build: who stops it then has no session.
TEST(Stop, sigtermBeforeTheRunLeavesNoDirectory) {
  const test::TemporaryFolder folder;
  Drive drive(folder / "s", false, 600);
  std::this_thread::sleep_for(100ms);
  drive.signal(SIGTERM);
  EXPECT_EQ(drive.wait(), 143);
  EXPECT_FALSE(fs::exists(folder / "s"));
}

TEST(Hangup, sighupOrClosedTerminalClosesSession) {
  const test::TemporaryFolder folder;
  for (const bool terminal : {false, true}) {
    const fs::path session = folder / (terminal ? "terminal" : "none");
    Drive drive(session, terminal, 600);
    ASSERT_TRUE(within(60, [&] { return lines_of(session / "poses.csv") > 5; }));
    if (terminal)
      drive.close_terminal();
    else
      drive.signal(SIGHUP);
    EXPECT_EQ(drive.wait(), 143);
    EXPECT_TRUE(fs::exists(session / "summary.json"));
    EXPECT_TRUE(fs::exists(session / "report.html"));
  }
}

}  // namespace
}  // namespace vergence
