// Drives whose terminal or disk takes nothing, and whose cameras give nothing.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <string>

#include "tests/support/temporary_folder.hpp"
#include "tests/system/run/live_drive.hpp"

namespace vergence {
namespace {

using namespace std::chrono_literals;
namespace fs = std::filesystem;

using test::Drive;
using test::lines_of;
using test::within;

class Pipe {
 public:
  Pipe() { (void)::pipe2(ends_.data(), O_CLOEXEC); }
  ~Pipe() {
    for (const int end : ends_) (void)::close(end);
  }
  Pipe(const Pipe&) = delete;
  Pipe& operator=(const Pipe&) = delete;

  [[nodiscard]] int input() const { return ends_[1]; }
  void fill() const {
    (void)::fcntl(ends_[1], F_SETFL, O_NONBLOCK);
    while (::write(ends_[1], "x", 1) == 1) {
    }
    (void)::fcntl(ends_[1], F_SETFL, 0);
  }

 private:
  std::array<int, 2> ends_{-1, -1};
};

void expect_whole(const fs::path& session) {
  EXPECT_GT(test::summary_of(session)["frames"]["posed"].get<int>(), 0);
  EXPECT_TRUE(fs::exists(session / "report.html"));
}

TEST(Run, aTerminalThatTakesNothingHoldsUpNeitherSigtermNorTheEnd) {
  const test::TemporaryFolder folder;
  const Pipe errors;
  errors.fill();
  Drive stopped(folder / "s", false, 600, {}, errors.input());
  ASSERT_TRUE(within(60, [&] { return lines_of(folder / "s" / "poses.csv") > 5; }));
  stopped.signal(SIGTERM);
  EXPECT_EQ(stopped.wait(30s), 143);
  expect_whole(folder / "s");
  Drive ended(folder / "e", false, 4, {}, errors.input());
  EXPECT_GE(ended.wait(60s), 0) << "it hangs";
  expect_whole(folder / "e");
}

TEST(Run, aDriveInRealTimeEndsByTheClockWhereEveryCameraIsGone) {
  const test::TemporaryFolder folder;
  Drive drive(folder / "s", false, 4,
              {"--quiet", "--fault", "camera_gone@2 camera=-1 duration_s=0"});
  EXPECT_EQ(drive.wait(60s), 3);
  expect_whole(folder / "s");
}

}  // namespace
}  // namespace vergence
