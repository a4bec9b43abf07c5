// The resident memory of a run of twenty minutes does not grow.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <string>
#include <system_error>
#include <thread>
#include <utility>

#include "tests/support/temporary_folder.hpp"
#include "tests/system/run/session.hpp"

namespace vergence::test {
namespace {

constexpr std::int64_t kKiB = 1024;

/// Resident bytes. The estimator's arena is zero pages that a drive comes to use one after the
/// other up to its capacity: it is measured separately, with what lies beside it in one mapping. Of
/// the large mappings the other is the mock's way, which is laid out at the start.
struct Resident {
  /// Resident part of large mappings without a file.
  std::int64_t arena = 0;
  /// Capacity of those mappings.
  std::int64_t arena_mapped = 0;
  /// Resident part of the rest of the process.
  std::int64_t others = 0;
};
constexpr std::int64_t kLargeMapping = 64 * 1024 * kKiB;

/// Resident memory of a process by its smaps (proc(5)); nullopt if it has ended.
std::optional<Resident> resident_of(pid_t process) {
  std::ifstream smaps("/proc/" + std::to_string(process) + "/smaps");
  std::int64_t size = 0, all = 0;
  bool has_file = false;
  Resident resident;
  for (std::string line; std::getline(smaps, line);) {
    const auto dash = line.find('-'), colon = line.find(':');
    // The line begins a mapping: 7f…-7f… rw-p 00000000 00:00 0 name.
    if (dash < colon && dash < line.find(' ')) {
      const std::uint64_t begin = std::strtoull(line.c_str(), nullptr, 16),
                          end = std::strtoull(line.c_str() + dash + 1, nullptr, 16);
      size = static_cast<std::int64_t>(end - begin);
      has_file = line.find_first_of("/[") != std::string::npos;
    } else if (line.starts_with("Rss:")) {
      const std::int64_t bytes = kKiB * std::strtoll(line.c_str() + 4, nullptr, 10);
      all += bytes;
      if (has_file || size < kLargeMapping) continue;
      resident.arena += bytes;
      resident.arena_mapped += size;
    }
  }
  if (all == 0) return std::nullopt;
  resident.others = all - resident.arena;
  return resident;
}

/// Files, sockets and pipes that a process has open.
int handles_of(pid_t process) {
  std::error_code ended;
  const std::filesystem::directory_iterator open("/proc/" + std::to_string(process) + "/fd", ended);
  return static_cast<int>(std::distance(begin(open), end(open)));
}

/// A drive that goes on for `seconds` of its own time with one frame a second.
struct SlowDrive {
  int seconds = 0;
  /// Speed in m/s, low enough for the path to last.
  double speed = 0.0;
  /// Number of frames after which growth counts.
  int settled = 0;
};

pid_t start(const SlowDrive& drive, const std::filesystem::path& session) {
  const std::string file = VERGENCE_SOURCE_DIR "/app/config/mock.yaml", out = session.string(),
                    duration = std::to_string(drive.seconds),
                    speed = "mock.speed=" + std::to_string(drive.speed);
  const pid_t process = ::fork();
  if (process != 0) return process;
  ::execl(VERGENCE_PROGRAM, "vergence", "run", file.c_str(), "--fast", "--quiet", "--duration",
          duration.c_str(), "--out", out.c_str(), "--set", speed.c_str(), "--set",
          "mock.texture_detail=0", "--set", "cameras.0.size=[320,240]", "--set",
          "cameras.1.size=[320,240]", "--set", "trigger.rate=1", "--set", "ins.rate=20", nullptr);
  ::_exit(127);
}

/// Resident once the drive has settled, and the last before its end or before `wall` is over.
struct Growth {
  std::optional<Resident> settled{};
  Resident at_the_end{};
  int handles_settled = 0, handles_at_the_end = 0;
  int frames = 0;
  /// Status of waitpid() of a run that ended before it was killed.
  int status = 0;
  /// True if `wall` expired while frames still came.
  bool too_slow = false;
};

Growth growth_of(const SlowDrive& drive, std::chrono::seconds wall) {
  // Frames before the end, from which on the report needs memory.
  constexpr int kReport = 5;
  constexpr std::chrono::milliseconds kLook{500};
  // A solve takes a few seconds on a busy machine.
  constexpr std::chrono::seconds kHung{20};
  const TemporaryFolder folder;
  const pid_t process = start(drive, folder / "s");
  const auto until = std::chrono::steady_clock::now() + wall;
  auto last_frame = std::chrono::steady_clock::now();
  int seen = 0;
  Growth growth;
  while (::waitpid(process, &growth.status, WNOHANG) == 0) {
    const auto now = resident_of(process);
    const int frames = static_cast<int>(lines_of(folder / "s" / "poses.csv")) - 1;
    if (frames != std::exchange(seen, frames)) last_frame = std::chrono::steady_clock::now();
    if (now && frames >= drive.settled && frames < drive.seconds - kReport) {
      if (!growth.settled) {
        growth.settled = now;
        growth.handles_settled = handles_of(process);
      }
      growth.at_the_end = *now;
      growth.handles_at_the_end = handles_of(process);
      growth.frames = frames;
    }
    if (std::chrono::steady_clock::now() > until) {
      growth.too_slow = std::chrono::steady_clock::now() - last_frame < kHung;
      (void)::kill(process, SIGKILL);
      (void)::waitpid(process, nullptr, 0);
      break;
    }
    std::this_thread::sleep_for(kLook);
  }
  return growth;
}

/// `least`: with fewer frames on a slow machine the test is skipped. A drive that ended early or
/// hung is a failure.
void expect_flat(const Growth& growth, int least) {
  constexpr std::int64_t kMiB = 1024 * kKiB;
  EXPECT_EQ(growth.status, 0) << "the drive ended by itself";
  if (growth.too_slow && growth.frames < least)
    GTEST_SKIP() << "needs a faster or less busy machine: " << growth.frames << " of " << least
                 << " frames in the time given";
  ASSERT_GE(growth.frames, least) << "the drive ended early, or hung";
  const std::int64_t others = growth.at_the_end.others - growth.settled->others,
                     arena = growth.at_the_end.arena - growth.settled->arena;
  EXPECT_LE(others, kMiB) << "after " << growth.frames << " frames";
  EXPECT_LE(growth.at_the_end.arena_mapped - growth.settled->arena_mapped, kMiB);
  EXPECT_EQ(growth.handles_at_the_end, growth.handles_settled);
  testing::Test::RecordProperty("frames", growth.frames);
  testing::Test::RecordProperty("growth_bytes", std::to_string(others));
  testing::Test::RecordProperty("growth_of_the_arena_bytes", std::to_string(arena));
}

TEST(ResidentMemory, twentyMinutesTakeNoMoreThanOne) {
  // Times in s, and numbers of frames.
  constexpr int kTwenty = 20 * 60, kTen = 10 * 60, kMinute = 60;
  expect_flat(growth_of({kTwenty, 0.8, kMinute}, std::chrono::seconds(100)), kTen);
}

}  // namespace
}  // namespace vergence::test
