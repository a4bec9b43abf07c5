// The resident memory of a run of twenty minutes does not grow.
#include <gtest/gtest.h>
#include <sys/types.h>

#include <cstdint>
#include <optional>

#include "tests/support/child_program.hpp"
#include "tests/system/run/session.hpp"

namespace vergence::test {
namespace {

/// Resident memory of a process in bytes by its statm (proc(5)); nullopt if it has ended.
std::optional<std::int64_t> resident_of(pid_t process) {
  std::ifstream statm("/proc/" + std::to_string(process) + "/statm");
  std::int64_t mapped = 0, resident = 0;
  if (!(statm >> mapped >> resident) || resident == 0) return std::nullopt;
  return resident * ::sysconf(_SC_PAGESIZE);
}

/// Files, sockets and pipes that a process has open.
int handles_of(pid_t process) {
  std::error_code ended;
  const std::filesystem::directory_iterator open("/proc/" + std::to_string(process) + "/fd", ended);
  return static_cast<int>(std::distance(begin(open), end(open)));
}

/// Length of the drive in s of its own time, with one frame a second.
constexpr int kSeconds = 20 * 60;
/// Number of frames after which growth counts. Solves of more and more frames come to use the
/// pages that the estimator has reserved.
constexpr int kSettled = 300;

/// Resident once the drive has settled, and the last before its end or before `wall` is over.
struct Growth {
  std::optional<std::int64_t> settled{};
  std::int64_t at_the_end = 0;
  int handles_settled = 0, handles_at_the_end = 0;
  int frames = 0;
  /// Exit code of the program; -1 if `wall` expired before.
  int code = -1;
  /// True if `wall` expired while frames still came.
  bool too_slow = false;
};

Growth growth_of_slow_drive(std::chrono::seconds wall) {
  // Frames before the end, from which on the report needs memory.
  constexpr int kReport = 5;
  constexpr std::chrono::seconds kLook{1};
  // A solve takes a few seconds on a busy machine.
  constexpr std::chrono::seconds kHung{20};
  const TemporaryFolder folder;
  // The speed, in m/s, is low enough for the path to last.
  ChildProgram process({"run",        VERGENCE_SOURCE_DIR "/app/config/mock.yaml",
                        "--fast",     "--quiet",
                        "--duration", std::to_string(kSeconds),
                        "--out",      (folder / "s").string(),
                        "--set",      "mock.speed=0.8",
                        "--set",      "mock.texture_detail=0",
                        "--set",      "cameras.0.size=[320,240]",
                        "--set",      "cameras.1.size=[320,240]",
                        "--set",      "trigger.rate=1",
                        "--set",      "ins.rate=20"});
  const auto until = std::chrono::steady_clock::now() + wall;
  auto last_frame = std::chrono::steady_clock::now();
  int seen = 0;
  Growth growth;
  while ((growth.code = process.wait(kLook)) < 0) {
    const auto now = resident_of(process.pid());
    const int frames = static_cast<int>(lines_of(folder / "s" / "poses.csv")) - 1;
    if (frames != std::exchange(seen, frames)) last_frame = std::chrono::steady_clock::now();
    if (now && frames >= kSettled && frames < kSeconds - kReport) {
      if (!growth.settled) {
        growth.settled = now;
        growth.handles_settled = handles_of(process.pid());
      }
      growth.at_the_end = *now;
      growth.handles_at_the_end = handles_of(process.pid());
      growth.frames = frames;
    }
    if (std::chrono::steady_clock::now() > until) {
      growth.too_slow = std::chrono::steady_clock::now() - last_frame < kHung;
      return growth;
    }
  }
  return growth;
}

/// `least`: with fewer frames on a slow machine the test is skipped. A drive that ended early or
/// hung is a failure.
void expect_flat(const Growth& growth, int least) {
  // In 10 000 frames memory grows by 1.7 MB and is constant from the 3800th on.
  constexpr std::int64_t kMost = 3 << 20;
  EXPECT_LE(growth.code, 0) << "the drive ended by itself";
  if (growth.too_slow && growth.frames < least)
    GTEST_SKIP() << "needs a faster or less busy machine: " << growth.frames << " of " << least
                 << " frames in the time given";
  ASSERT_GE(growth.frames, least) << "the drive ended early, or hung";
  const std::int64_t grown = growth.at_the_end - *growth.settled;
  EXPECT_LE(grown, kMost) << "after " << growth.frames << " frames";
  EXPECT_EQ(growth.handles_at_the_end, growth.handles_settled);
}

TEST(ResidentMemory, twentyMinutesTakeNoMoreThanOne) {
  expect_flat(growth_of_slow_drive(std::chrono::seconds(100)), kSeconds / 2);
}

}  // namespace
}  // namespace vergence::test
