// SIGTERM before a drive has begun, SIGHUP in the middle of it.
#include <gtest/gtest.h>

#include "tests/system/run/live_drive.hpp"

namespace vergence {
namespace {

using namespace std::chrono_literals;
namespace fs = std::filesystem;

// Devices take seconds to open, a mock's world to build: who stops it then has no session.
TEST(Stop, sigtermBeforeTheRunLeavesNoDirectory) {
  const test::TemporaryFolder folder;
  test::Drive drive(folder / "s", false, 600);
  std::this_thread::sleep_for(100ms);
  drive.signal(SIGTERM);
  EXPECT_EQ(drive.wait(), 143);
  EXPECT_FALSE(fs::exists(folder / "s"));
}

TEST(Hangup, sighupOrClosedTerminalClosesSession) {
  const test::TemporaryFolder folder;
  for (const bool terminal : {false, true}) {
    const fs::path session = folder / (terminal ? "terminal" : "none");
    test::Drive drive(session, terminal, 600);
    ASSERT_TRUE(test::within(60, [&] { return test::lines_of(session / "poses.csv") > 5; }));
    if (terminal)
      drive.close_terminal();
    else
      drive.signal(SIGHUP);
    EXPECT_EQ(drive.wait(), 143);
    EXPECT_TRUE(fs::exists(session / "summary.json"));
    EXPECT_TRUE(fs::exists(session / "report.html"));
  }
}

// A drive whose cameras give nothing.

TEST(Run, runEndsOnTimeWithoutAnyCamera) {
  const test::TemporaryFolder folder;
  test::Drive drive(folder / "s", false, 4,
                    {"--quiet", "--fault", "camera_gone@2 camera=-1 duration_s=0"});
  EXPECT_EQ(drive.wait(60s), 3);
  EXPECT_GT(test::summary_of(folder / "s")["frames"]["posed"].get<int>(), 0);
  EXPECT_TRUE(std::filesystem::exists(folder / "s" / "report.html"));
}

}  // namespace
}  // namespace vergence
