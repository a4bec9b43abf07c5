// SIGHUP on a drive: the files are opened again, unless the terminal has gone. SIGTERM before it.
#include <gtest/gtest.h>
#include <pty.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/temporary_folder.hpp"
#include "tests/system/run/session.hpp"

namespace vergence {
namespace {

using namespace std::chrono_literals;
namespace fs = std::filesystem;

/// The program on a drive of the mock in real time, as the leader of a session of its own: with a
/// terminal, or with none.
class Drive {
 public:
  Drive(const fs::path& session, bool terminal, int seconds) {
    std::vector<std::string> words{VERGENCE_PROGRAM,
                                   "run",
                                   std::string(VERGENCE_SOURCE_DIR) + "/app/config/mock.yaml",
                                   "--duration",
                                   std::to_string(seconds),
                                   "--out",
                                   session.string(),
                                   "--quiet",
                                   "--record",
                                   "poses",
                                   "--set",
                                   "cameras.0.size=[320,240]",
                                   "--set",
                                   "cameras.1.size=[320,240]",
                                   "--set",
                                   "mock.texture_detail=0"};
    std::vector<char*> pointers;
    for (std::string& w : words) pointers.push_back(w.data());
    pointers.push_back(nullptr);
    pid_ = terminal ? ::forkpty(&terminal_, nullptr, nullptr, nullptr) : ::fork();
    if (pid_ != 0) return;
    if (!terminal) (void)::setsid();
    (void)::execv(pointers.front(), pointers.data());
    ::_exit(127);
  }
  ~Drive() {
    close_terminal();
    if (pid_ > 0 && ::kill(pid_, SIGKILL) == 0) (void)::waitpid(pid_, nullptr, 0);
  }
  Drive(const Drive&) = delete;
  Drive& operator=(const Drive&) = delete;

  void signal(int number) const { (void)::kill(pid_, number); }
  void close_terminal() {
    if (terminal_ >= 0) (void)::close(terminal_);
    terminal_ = -1;
  }
  /// → exit code; 128 + the signal's number.
  int wait() {
    int status = 0;
    (void)::waitpid(pid_, &status, 0);
    pid_ = -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }

 private:
  pid_t pid_ = -1;
  int terminal_ = -1;
};

template <class Holds>
bool within(std::chrono::seconds limit, const Holds& holds) {
  const auto end = std::chrono::steady_clock::now() + limit;
  while (!holds())
    if (std::chrono::steady_clock::now() > end)
      return false;
    else
      std::this_thread::sleep_for(20ms);
  return true;
}

std::string head_of(const fs::path& file) {
  const std::string text = test::text_of(file);
  return text.substr(0, text.find('\n'));
}

std::size_t lines_of(const fs::path& file) {
  const std::string text = test::text_of(file);
  return static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
}

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
